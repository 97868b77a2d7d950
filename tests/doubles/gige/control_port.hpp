// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <netinet/in.h>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "tests/doubles/gige/register_file.hpp"

namespace slsd::test {

/// What the control port tells of besides what it wrote into the registers itself.
struct ControlEvents {
  std::function<void(std::uint32_t address, std::uint32_t value)> written;
  std::function<void(std::uint16_t frame, std::uint32_t first, std::uint32_t last)> resend_asked;
  std::function<void()> controller_left;
  /// One that its keys concern, and when by the device's clock it is to act.
  std::function<void(std::optional<std::uint64_t> ticks)> action;
};

/// The action commands that came, whatever their keys.
struct ActionCounts {
  int received = 0;
  int scheduled = 0;  ///< of these for a certain time
};

/// The GVCP side of a GigE Vision device: answers what is asked of its registers, and lets one controller write.
/// @thread thread-bound
class ControlPort {
 public:
  ControlPort(RegisterFile& registers, ControlEvents events);

  /// The answer to a command; empty where there is none.
  [[nodiscard]] const std::vector<std::uint8_t>& answer(std::span<const std::uint8_t> command, const sockaddr_in& from);

  /// Ends the control of one that was not heard for longer than its heartbeat allows.
  void expire_controller();
  /// As if another application had taken control (true), or had gone (false).
  void occupy(bool by_another);
  [[nodiscard]] bool controlled() const { return controller_.has_value(); }
  [[nodiscard]] int times_taken() const { return times_taken_; }
  [[nodiscard]] const ActionCounts& actions() const { return actions_; }

 private:
  [[nodiscard]] bool is_sent_again(std::uint32_t id, const sockaddr_in& from) const;
  [[nodiscard]] bool may_write(std::uint32_t address, const sockaddr_in& from) const;
  void answer_read(std::uint32_t what, std::uint32_t id, std::uint32_t address, std::size_t bytes);
  void answer_read_memory(std::uint32_t id, std::span<const std::uint8_t> body);
  void answer_write(std::uint32_t what, std::uint32_t id, std::span<const std::uint8_t> body, const sockaddr_in& from);
  void act(bool scheduled, std::span<const std::uint8_t> body);
  void ask_resend(std::span<const std::uint8_t> body);
  void write(std::uint32_t address, std::uint32_t value, const sockaddr_in& from);
  [[nodiscard]] bool write_block(std::uint32_t address, std::span<const std::uint8_t> block, const sockaddr_in& from);
  void release();

  RegisterFile& registers_;
  ControlEvents events_;
  std::optional<sockaddr_in> controller_;
  std::chrono::steady_clock::time_point heard_;
  bool occupied_ = false;
  int times_taken_ = 0;
  ActionCounts actions_;
  /// A write that was answered: whoever did not hear the answer in time sends it again.
  struct Written {
    std::uint32_t id;
    sockaddr_in from;
  };
  std::optional<Written> written_;
  std::vector<std::uint8_t> answer_;
  std::vector<std::uint8_t> answer_to_written_;
  std::vector<std::uint8_t> block_;
};

}  // namespace slsd::test
