// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/result.hpp"
#include "daemon/configuration/configuration.hpp"
#include "daemon/scan/bounded_queue.hpp"
#include "daemon/scan/heartbeat.hpp"
#include "daemon/scan/rig.hpp"
#include "daemon/scan/scan_statistics.hpp"

namespace slsd {

/// What scans in free run give: a cloud, or why there is none.
using FreeScan = std::shared_ptr<const Result<ScanResult>>;  // shared: every subscriber reads it at its own pace

/// The thread that scans. Takes requests one after the other, from a queue of bounded length; while somebody
/// subscribes it scans by itself in between.
/// @thread thread-safe; each answer is called exactly once, on the scanner's own thread or, where there is no room for
/// the
///         request, at once
class Scanner {
 public:
  template <class Value>
  using Answer = std::function<void(Result<Value>)>;

  explicit Scanner(std::unique_ptr<Rig> rig);
  ~Scanner();
  Scanner(const Scanner&) = delete;
  Scanner& operator=(const Scanner&) = delete;

  /// @errors (as an answer) kBusy: too many requests wait; kTimeout: its time was over before its turn; kCancelled:
  ///         the service is stopping; those of Rig::scan()
  void scan(const ScanRequest& request, Answer<ScanResult> answer);
  void frame(const std::string& camera, bool as_png, MonotonicTime deadline, Answer<FrameImage> answer);
  /// The pattern's image as a PNG.
  void pattern(Answer<std::string> answer);
  /// Reads the configuration anew and takes its pattern, calibration and decoder options; one that is wrong changes
  /// nothing.
  /// @param running  the configuration whose projector and cameras are in use, and stay
  void reload(const std::filesystem::path& file, const Configuration& running, Answer<Configuration> answer);

  /// Scans by itself from now on, at most so often; nothing stops it. Results go to the listener.
  void run_freely(std::optional<double> rate_hz);
  /// Called on the scanner's thread with each free scan and each asked-for one. Set before the first request.
  void set_listener(std::function<void(FreeScan)> listener) { listener_ = std::move(listener); }

  [[nodiscard]] const Heartbeat& heartbeat() const { return heartbeat_; }
  [[nodiscard]] ScanTotals totals() const { return statistics_.totals(); }
  [[nodiscard]] const Rig& rig() const { return *rig_; }  ///< for its statuses

  /// Ends what is under way, soon, and the thread; requests that wait are answered kCancelled.
  void request_stop();
  /// Whether the thread came to its end within the time.
  [[nodiscard]] bool wait_stopped(std::chrono::milliseconds time);

 private:
  using Job = std::function<void(const Result<>& permission)>;
  void run(const std::stop_token& stop);
  void refuse_waiting();
  void scan_freely(const std::stop_token& stop);
  [[nodiscard]] MonotonicTime next_wake() const;
  [[nodiscard]] Result<ScanResult> transact(const ScanRequest& request);
  void submit(Job job);
  void log_outcome(const std::string& scan_id, const Result<ScanResult>& result);

  std::unique_ptr<Rig> rig_;
  std::function<void(FreeScan)> listener_;
  BoundedQueue<Job> queue_;
  Heartbeat heartbeat_;
  ScanStatistics statistics_;
  std::string run_id_;
  std::uint64_t scans_ = 0;
  bool failing_ = false;
  std::atomic<double> free_rate_hz_{0};  ///< 0: only when asked; infinity: as fast as frames come
  MonotonicTime next_free_scan_{};
  std::atomic<bool> stopped_{false};
  std::jthread thread_;
};

}  // namespace slsd
