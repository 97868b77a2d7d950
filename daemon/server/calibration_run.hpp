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

/// A calibration session: runs slsd-calibrate as a separate process. It shows and takes its pictures over the service's
/// socket, and reports what it sees on its standard output. There is one session at a time.
///
///     none --begin()--> under way --its process ends well--> taking force --conclude()--> none
///                           \-----it fails, or cancel()------------------------------------^
///
/// @thread thread-bound to the event loop's
class CalibrationRun {
 public:
  /// @param ended  called when the process has ended: whether it made a calibration; if so, call conclude()
  CalibrationRun(asio::io_context& events, std::function<void(bool made)> ended);
  ~CalibrationRun();
  CalibrationRun(const CalibrationRun&) = delete;
  CalibrationRun& operator=(const CalibrationRun&) = delete;

  /// @errors kBusy: a session is under way; kIo: the process cannot be started
  [[nodiscard]] Result<> begin(const std::filesystem::path& program, const std::vector<std::string>& arguments);
  /// Calibrates from the poses taken so far.
  void end();
  /// Cancels the session.
  void cancel();
  /// Notes whether the calibration that the process wrote is in force.
  void conclude(const Result<>& in_force);

  [[nodiscard]] bool under_way() const { return phase_ != Phase::kNone; }
  /// The process whose requests belong to the session; 0: none.
  [[nodiscard]] pid_t process() const { return process_; }
  /// The session's state, and the outcome of the last session. Clients that show a session call this repeatedly. A
  /// session that nobody looks at any more is cancelled.
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
  std::uint64_t number_ = 0;  ///< grows with each new report
  std::chrono::steady_clock::time_point looked_{};
  nlohmann::json progress_;
  nlohmann::json outcome_;
  nlohmann::json error_;
  std::deque<std::string> log_;  ///< the last lines meant for a person
};

}  // namespace slsd
