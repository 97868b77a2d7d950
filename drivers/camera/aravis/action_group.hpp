// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "drivers/camera/aravis/gvcp.hpp"

namespace slsd {

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
    /// @param ticks  by the device's clock, which all members then share; nothing: at once
    void trigger(std::optional<std::uint64_t> ticks);

   private:
    friend class ActionGroup;
    std::shared_ptr<ActionGroup> group_;
    std::string address_;
    std::string interface_;
    bool asks_ = false;
  };

  /// The group of this process that has these keys; it ends with its last member.
  [[nodiscard]] static std::shared_ptr<ActionGroup> of(const ActionKeys& keys);
  explicit ActionGroup(const ActionKeys& keys) : keys_(keys) {}

 private:
  [[nodiscard]] bool all_ask() const;
  void send(std::optional<std::uint64_t> ticks);

  const ActionKeys keys_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Member*> members_;
  std::uint64_t commands_ = 0;
};

}  // namespace slsd
