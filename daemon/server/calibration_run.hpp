// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <sys/types.h>

#include <array>
#include <chrono>
#include <deque>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <asio/io_context.hpp>
#include <asio/posix/stream_descriptor.hpp>
#include <asio/steady_timer.hpp>
#include <nlohmann/json.hpp>

#include "core/result.hpp"

namespace slsd {

/// A session of calibrating: slsd-calibrate as a process of its own, which shows and takes its pictures over the
/// service's socket and tells on its standard output what it sees. One at a time.
///
///     none --begin()--> under way --its process ends well--> taking force --conclude()--> none
///                           \-----it fails, or cancel()------------------------------------^
///
/// @thread thread-bound: the event loop's
class CalibrationRun {
 public:
  /// @param ended  called when its process has ended: whether it made a calibration, and then conclude() is due
  CalibrationRun(asio::io_context& events, std::function<void(bool made)> ended);
  ~CalibrationRun();
  CalibrationRun(const CalibrationRun&) = delete;
  CalibrationRun& operator=(const CalibrationRun&) = delete;

  /// @errors kBusy: one is under way; kIo: it cannot be started
  [[nodiscard]] Result<> begin(const std::filesystem::path& program, const std::vector<std::string>& arguments);
  /// Calibrates from the poses that are there.
  void end();
  /// Gives it up.
  void cancel();
  /// Notes whether the calibration that it wrote is in force.
  void conclude(const Result<>& in_force);

  [[nodiscard]] bool under_way() const { return phase_ != Phase::kNone; }
  /// The process whose requests are the session's own; 0: none.
  [[nodiscard]] pid_t process() const { return process_; }
  /// The session's state, and the outcome of the last one. Clients that show a session call this again and again: a
  /// session that nobody looks at any more is given up.
  [[nodiscard]] nlohmann::json look();

 private:
  enum class Phase { kNone, kUnderWay, kTakingForce };
  void read();
  void take_line(const std::string& line);
  void await_exit();
  void on_exit(int status);
  void watch();

  std::function<void(bool made)> ended_;
  asio::posix::stream_descriptor output_;
  asio::steady_timer exit_;
  asio::steady_timer watch_;
  std::array<char, 16384> chunk_{};
  std::string line_;
  pid_t process_ = 0;
  Phase phase_ = Phase::kNone;
  bool cancelled_ = false;
  std::uint64_t number_ = 0;  ///< grows with everything that is told
  std::chrono::steady_clock::time_point looked_{};
  nlohmann::json progress_;
  nlohmann::json outcome_;
  nlohmann::json error_;
  std::deque<std::string> log_;  ///< its last lines for a person
};

}  // namespace slsd
