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
#include "daemon/scan/calibration_watch.hpp"
#include "daemon/scan/decode_lanes.hpp"
#include "daemon/scan/frame_jobs.hpp"
#include "daemon/scan/hardware_guard.hpp"
#include "daemon/scan/heartbeat.hpp"
#include "daemon/scan/projected_picture.hpp"
#include "daemon/scan/rig.hpp"
#include "daemon/scan/scan_statistics.hpp"

namespace slsd {

/// What scans in free run give: a cloud, or why there is none.
using FreeScan = std::shared_ptr<const Result<ScanResult>>;  // shared: every subscriber reads it at its own pace

/// The thread that captures, and the lanes that decode meanwhile. Takes requests one after the other, from a queue of
/// bounded length; while somebody subscribes it scans by itself in between. A scan that was asked for is always
/// decoded; of those in free run the newest are, where decoding is slower than the cameras, and the rest are counted.
/// @thread thread-safe; each answer is called exactly once, on one of the scanner's own threads or, where there is no
///         room for the request, at once; what scans give is called in their order
class Scanner {
 public:
  template <class Value>
  using Answer = std::function<void(const Result<Value>&)>;

  Scanner(std::unique_ptr<Rig> rig, ScanSetup setup);
  ~Scanner();
  Scanner(const Scanner&) = delete;
  Scanner& operator=(const Scanner&) = delete;

  /// @errors (as an answer) kBusy: too many requests wait; kTimeout: its time was over before its turn; kCancelled:
  ///         the service is stopping; those of Rig::capture() and reconstruct()
  void scan(const ScanRequest& request, Answer<ScanResult> answer);
  void frame(const FrameRequest& request, Answer<FrameImage> answer);
  /// Shows a picture until the next scan or frame. @errors (as an answer) kBusy, kCancelled, those of draw_projected()
  ///         and Rig::hold()
  void project(const ProjectRequest& request, Answer<void> answer);
  /// The pattern's image as a PNG.
  void pattern(Answer<std::string> answer);
  /// The pattern and the calibration in force.
  void files(Answer<ScanFiles> answer);
  /// Reads the configuration anew and takes its pattern, calibration and decoder options; one that is wrong changes
  /// nothing.
  /// @param running  the configuration whose projector and cameras are in use, and stay
  void reload(const std::filesystem::path& file, const Configuration& running, Answer<Configuration> answer);

  /// Scans by itself from now on, at most so often; nothing stops it. Results go to the listener.
  void run_freely(std::optional<double> rate_hz);
  /// Called on one of the scanner's threads with each free scan and each asked-for one, in their order. Set before the
  /// first request.
  void set_listener(std::function<void(FreeScan)> listener) { listener_ = std::move(listener); }

  /// Whether all its threads keep their promises to the watchdog.
  [[nodiscard]] bool kept() const { return heartbeat_.kept() && lanes_.kept() && rig_->kept(); }
  [[nodiscard]] ScanTotals totals() const { return statistics_.totals(); }
  /// A scan's cloud was handed to a client's socket, so long after the last byte of its frames was there.
  void note_latency(std::chrono::nanoseconds time) { statistics_.note_latency(time); }
  /// What the scans say of the calibration, one to a configured camera; empty before the first scan.
  [[nodiscard]] std::vector<DriftState> drifts() const { return watch_.states(); }
  [[nodiscard]] const Rig& rig() const { return *rig_; }  ///< for its statuses

  /// Ends what is under way, soon, and the thread; requests that wait are answered kCancelled.
  void request_stop();
  /// Whether the threads came to their ends, and the cameras are closed, within the time.
  [[nodiscard]] bool wait_stopped(std::chrono::milliseconds time);

 private:
  using Job = std::function<void(const Result<>& permission)>;
  void run(const std::stop_token& stop);
  void refuse_waiting();
  void scan_freely();
  [[nodiscard]] MonotonicTime next_wake() const;
  [[nodiscard]] bool free_scan_due() const;
  template <class Take>
  [[nodiscard]] auto take_frames(MonotonicTime deadline, Take take);
  [[nodiscard]] Result<FrameSet> capture(const ScanRequest& request, Exposure exposure);
  [[nodiscard]] std::unique_ptr<ScanJob> decoding(Result<FrameSet> set, const ScanRequest& request, bool listened,
                                                  Answer<ScanResult> answer);
  void conclude(const SharedSetup& setup, std::uint64_t number, const std::string& scan_id, Result<ScanResult>& result);
  void submit(Job job);
  void log_outcome(const std::string& scan_id, const Result<ScanResult>& result);

  std::unique_ptr<Rig> rig_;
  SharedSetup setup_;  ///< of the next scan
  std::function<void(FreeScan)> listener_;
  BoundedQueue<Job> queue_;
  Heartbeat heartbeat_;
  ScanStatistics statistics_;
  CalibrationWatch watch_;
  HardwareGuard hardware_;
  std::string run_id_;
  std::uint64_t scans_ = 0;
  std::uint64_t skipped_told_ = 0;
  std::atomic<int> failures_in_a_row_{0};
  std::atomic<double> free_rate_hz_{0};  ///< 0: only when asked; infinity: as fast as frames come
  MonotonicTime next_free_scan_{};
  bool every_frame_ = false;  ///< the next free scan is due when the one before is captured
  std::atomic<bool> stopped_{false};
  DecodeLanes lanes_;
  std::jthread thread_;
};

}  // namespace slsd
