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

/// Gives the time to expose at, by the device's clock; without a value: at once. @thread any member's
using ActionTime = std::function<std::optional<std::uint64_t>()>;

/// The GigE Vision cameras of this process that expose at one action command. Each member asks for its exposure, and
/// when all have, or after a short wait for the others, the command goes to every member at once.
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

    /// Waits for the others, for a few milliseconds at most, and sees to it that the command is sent.
    /// @param time  asked for when the command is sent, of every member that asks: all expose at the latest of their
    ///              times, by the clock that they share, or at once where one has none
    void trigger(const ActionTime& time);

   private:
    friend class ActionGroup;
    std::shared_ptr<ActionGroup> group_;
    std::string address_;
    std::string interface_;
    const ActionTime* asks_ = nullptr;  ///< set while it waits for the command
  };

  /// The group of this process that has these keys; it ends with its last member.
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
