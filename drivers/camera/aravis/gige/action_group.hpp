// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "drivers/camera/aravis/gvcp.hpp"

namespace slsd {

/// Returns the device time of the exposure; without a value: at once. @thread any member's
using ActionTime = std::function<std::optional<std::uint64_t>()>;

/// The GigE Vision cameras of this process that expose at one action command. Each member requests its exposure. When
/// all have, or after a short wait for the others, the command goes to every member at once.
///
///     left   --trigger()------->|
///     right  ------trigger()--->| command to both, at once or for a common time
///
/// @thread thread-safe
class ActionGroup {
 public:
  /// One camera in the group, for as long as this lives.
  class Member {
   public:
    Member(std::shared_ptr<ActionGroup> group, std::string address, std::string interface);
    ~Member();
    Member(const Member&) = delete;
    Member& operator=(const Member&) = delete;

    /// Waits a few milliseconds at most for the other members, then makes sure that the command is sent.
    /// @param time  asked of every waiting member when the command is sent. All expose at the latest of these times on
    ///              their common clock, or at once if a member returns none
    void trigger(const ActionTime& time);

   private:
    friend class ActionGroup;
    std::shared_ptr<ActionGroup> group_;
    std::string address_;
    std::string interface_;
    const ActionTime* asks_ = nullptr;  ///< set while it waits for the command
  };

  /// The group of this process with these keys; it ends with its last member.
  [[nodiscard]] static std::shared_ptr<ActionGroup> of(const ActionKeys& keys);
  explicit ActionGroup(const ActionKeys& keys) : keys_(keys) {}

 private:
  [[nodiscard]] bool all_ask() const;
  [[nodiscard]] std::optional<std::uint64_t> time() const;
  void send();

  const ActionKeys keys_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Member*> members_;
  std::uint64_t commands_ = 0;
};

}  // namespace slsd
