// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/result.hpp"
#include "daemon/configuration/configuration.hpp"
#include "daemon/scan/black_box.hpp"
#include "daemon/scan/cloud/calibration_watch.hpp"
#include "daemon/scan/cloud/decode_lanes.hpp"
#include "daemon/scan/deadlines.hpp"
#include "daemon/scan/rig/hardware_guard.hpp"
#include "daemon/scan/rig/projected_picture.hpp"
#include "daemon/scan/rig/rig.hpp"
#include "daemon/scan/scan.hpp"
#include "daemon/scan/scan_statistics.hpp"
#include "drivers/system/bounded_queue.hpp"
#include "drivers/system/heartbeat.hpp"

namespace slsd {

/// The outcome of a scan in free run: a cloud, or the reason why there is none.
using FreeScan = std::shared_ptr<const Result<ScanResult>>;  // shared: every subscriber reads it at its own pace

/// The combined wishes of the subscribers.
struct FreeRun {
  double rate_hz = 0;  ///< maximum rate; infinity: every frame
  CloudFormats formats;
};

/// The threads between clients and devices: one takes frames, task by task; lanes decode meanwhile; one ends overdue
/// tasks; one works without devices. While somebody subscribes, it also scans freely between tasks. A requested scan is
/// always decoded. If decoding is slower than the cameras, only the newest free scans are decoded, and the skipped ones
/// are counted.
/// @thread thread-safe; each answer is called exactly once: on a thread of the scanner, on the thread that ends its
///         request, or at once if the queue is full. Outcomes of scans are delivered in order
class Scanner {
 public:
  template <class Value>
  using Answer = std::function<void(const Result<Value>&)>;

  /// @param black_box_bytes  as for BlackBox
  Scanner(std::unique_ptr<Rig> rig, ScanSetup setup, std::size_t black_box_bytes = 0);
  ~Scanner();
  Scanner(const Scanner&) = delete;
  Scanner& operator=(const Scanner&) = delete;

  // Each of these ends soon after its deadline, or when its client is gone, whatever a device does.

  /// @errors (as an answer) kBusy: too many requests wait; kTimeout: its time is over, with the device that delayed it;
  ///         kCancelled: the client is gone, or the service is stopping; those of Rig::capture() and reconstruct()
  void scan(ScanRequest request, Answer<ScanResult> answer);
  void frame(FrameRequest request, Answer<FrameImage> answer);
  /// Shows a picture until the next scan or frame. @errors (as an answer) as scan(), those of draw_projected() and
  /// Rig::hold()
  void project(ProjectRequest request, Answer<void> answer);

  // These do not wait for a device.

  /// The setup that decodes the next scan.
  [[nodiscard]] SharedSetup setup() const;
  /// The pattern's image as a PNG.
  void pattern(Answer<std::string> answer);
  /// Reads the configuration again and rebuilds all that depends on its pattern, calibration and decoder options. The
  /// next scan uses the result. On an error nothing changes.
  /// @param running  the configuration whose projector and cameras stay in use
  /// @param settings  set over the socket; they override the file. Camera settings take effect at once, unless a camera
  ///                  refuses them
  void reload(const std::filesystem::path& file, const Configuration& running, nlohmann::json settings,
              Answer<Configuration> answer);

  /// The last scans, delivered on a thread that has time to write them.
  void last_scans(Answer<std::vector<KeptScan>> answer);

  /// Starts or stops free scans. Results go to the listener.
  void run_freely(std::optional<FreeRun> demand);
  /// Called on a thread of the scanner with each free and each requested scan, in order. Set before the first request.
  void set_listener(std::function<void(FreeScan)> listener) { listener_ = std::move(listener); }

  /// Called with each scan that failed, on one of the scanner's threads. Set before the first request.
  void set_failure_listener(std::function<void(const std::string& scan_id, const Error&)> listener) {
    failure_listener_ = std::move(listener);
  }

  /// Tells whether all threads keep their promises to the watchdog.
  [[nodiscard]] bool kept() const;
  [[nodiscard]] ScanTotals totals() const { return statistics_.totals(); }
  /// Records the time from the last byte of a scan's frames to its cloud at a client's socket.
  void note_latency(std::chrono::nanoseconds time) { statistics_.note_latency(time); }
  /// The drift of the calibration according to the scans, one for each camera that measures; empty before the first
  /// scan.
  [[nodiscard]] std::vector<DriftState> drifts() const { return watch_.states(); }
  [[nodiscard]] const BlackBox& black_box() const { return black_box_; }  ///< metrics read its figures
  [[nodiscard]] const Rig& rig() const { return *rig_; }                  ///< clients read its statuses

  /// Soon ends the work under way and the threads; answers waiting requests with kCancelled.
  void request_stop();
  /// Tells whether the threads ended and the cameras closed within the time.
  [[nodiscard]] bool wait_stopped(std::chrono::milliseconds time);

 private:
  /// A task and the work for its turn.
  struct Turn {
    std::shared_ptr<Task> task;
    std::function<void()> take;
  };
  /// Called once, with permission to work or the reason why not.
  using Chore = std::function<void(const Result<>& permission)>;

  void run(const std::stop_token& stop);
  void run_chores(const std::stop_token& stop);
  void adopt_setup();
  void take_turn(const Turn& turn);
  void scan_freely();
  [[nodiscard]] MonotonicTime next_wake() const;
  [[nodiscard]] bool free_scan_due() const;

  void submit(Turn turn, const std::stop_token& gone);
  void submit_chore(Chore chore);
  void refuse_chores();
  [[nodiscard]] Result<> set_exposures(const std::vector<CameraOptions>& running,
                                       const std::vector<CameraOptions>& wanted, std::chrono::milliseconds time);
  [[nodiscard]] std::shared_ptr<Scan> make_scan(ScanRequest request, bool listened, Answer<ScanResult> answer);
  [[nodiscard]] WaitLimit limit_of(Task& task);
  [[nodiscard]] std::function<bool(const Error&)> wait_for_frames(Task& task);
  [[nodiscard]] std::function<bool(const Error&)> try_again(Task& task, std::function<void(const Error&)> note);
  [[nodiscard]] Error overdue(const Task& task) const;
  void conclude(const Scan& scan, Result<ScanResult>& result);
  void log_outcome(const std::string& scan_id, const Result<ScanResult>& result);

  std::unique_ptr<Rig> rig_;
  mutable std::mutex mutex_;  ///< guards the two below
  SharedSetup setup_;
  std::shared_ptr<Task> under_way_;  ///< the task on the scanner's thread
  SharedSetup adopted_;              ///< the setup that the scanner's thread uses
  std::function<void(FreeScan)> listener_;
  std::function<void(const std::string&, const Error&)> failure_listener_;
  BoundedQueue<Turn> queue_;
  BoundedQueue<Chore> chores_;
  Heartbeat heartbeat_;
  Heartbeat chore_heartbeat_;
  ScanStatistics statistics_;
  CalibrationWatch watch_;
  BlackBox black_box_;
  HardwareGuard hardware_;
  std::string run_id_;
  std::atomic<std::uint64_t> scans_{0};
  std::mutex concluding_;  ///< guards skipped_reported_, and keeps the log in the order of the totals
  std::uint64_t skipped_reported_ = 0;
  std::atomic<int> failures_in_a_row_{0};
  std::atomic<bool> empty_reported_{false};  ///< the log has the cause of the empty clouds
  std::atomic<double> free_rate_hz_{0};      ///< 0: only on request
  std::atomic<CloudFormats> free_formats_{};
  MonotonicTime next_free_scan_{};
  bool every_frame_ = false;  ///< the next free scan is due as soon as the previous one is captured
  std::atomic<int> running_{2};
  DecodeLanes lanes_;
  Deadlines deadlines_;
  std::jthread chores_thread_;
  std::jthread thread_;
};

}  // namespace slsd
