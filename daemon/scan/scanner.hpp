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
#include "daemon/scan/bounded_queue.hpp"
#include "daemon/scan/calibration_watch.hpp"
#include "daemon/scan/deadlines.hpp"
#include "daemon/scan/decode_lanes.hpp"
#include "daemon/scan/hardware_guard.hpp"
#include "daemon/scan/heartbeat.hpp"
#include "daemon/scan/projected_picture.hpp"
#include "daemon/scan/rig.hpp"
#include "daemon/scan/scan.hpp"
#include "daemon/scan/scan_statistics.hpp"

namespace slsd {

/// The outcome of a scan in free run: a cloud, or the reason for having none.
using FreeScan = std::shared_ptr<const Result<ScanResult>>;  // shared: every subscriber reads it at its own pace

/// The combined wishes of the subscribers.
struct FreeRun {
  double rate_hz = 0;  ///< maximum rate; infinity: as fast as frames come
  CloudFormats formats;
};

/// The threads between clients and devices: one that takes frames, task by task, the lanes that decode meanwhile, one
/// that ends tasks whose time is over, and one for what needs no device. While somebody subscribes it scans by itself
/// between the tasks. A scan that was asked for is always decoded; of those in free run the newest are, where decoding
/// is slower than the cameras, and the rest are counted.
/// @thread thread-safe; each answer is called exactly once, on one of the scanner's own threads, on the one that ends
///         its request, or, where there is no room for it, at once. What scans give is told in their order.
class Scanner {
 public:
  template <class Value>
  using Answer = std::function<void(const Result<Value>&)>;

  /// @param black_box_bytes  as BlackBox has it
  Scanner(std::unique_ptr<Rig> rig, ScanSetup setup, std::size_t black_box_bytes = 0);
  ~Scanner();
  Scanner(const Scanner&) = delete;
  Scanner& operator=(const Scanner&) = delete;

  // Each of these is over soon after its deadline, whatever a device does, and when its client is gone.

  /// @errors (as an answer) kBusy: too many requests wait; kTimeout: its time was over, with the device that held it
  /// up;
  ///         kCancelled: the client is gone, or the service is stopping; those of Rig::capture() and reconstruct()
  void scan(ScanRequest request, Answer<ScanResult> answer);
  void frame(FrameRequest request, Answer<FrameImage> answer);
  /// Shows a picture until the next scan or frame. @errors (as an answer) as scan(), those of draw_projected() and
  /// Rig::hold()
  void project(ProjectRequest request, Answer<void> answer);

  // These wait for no device.

  /// The setup that decodes the next scan.
  [[nodiscard]] SharedSetup setup() const;
  /// The pattern's image as a PNG.
  void pattern(Answer<std::string> answer);
  /// Reads the configuration anew, makes what follows from its pattern, calibration and decoder options, and puts that
  /// in force for the next scan; where something is wrong nothing changes.
  /// @param running  the configuration whose projector and cameras are in use, and stay
  /// @param settings  set over the socket, over the file's: those of the cameras are in force at once, too, where no
  ///                  camera refuses them
  void reload(const std::filesystem::path& file, const Configuration& running, nlohmann::json settings,
              Answer<Configuration> answer);

  /// The last scans, on a thread that has time to write them.
  void last_scans(Answer<std::vector<KeptScan>> answer);

  /// Scans by itself from now on, or no longer. Results go to the listener.
  void run_freely(std::optional<FreeRun> demand);
  /// Called on one of the scanner's threads with each free scan and each asked-for one, in their order. Set before the
  /// first request.
  void set_listener(std::function<void(FreeScan)> listener) { listener_ = std::move(listener); }

  /// Called with each scan that failed, on one of the scanner's threads. Set before the first request.
  void set_failure_listener(std::function<void(const std::string& scan_id, const Error&)> listener) {
    failure_listener_ = std::move(listener);
  }

  /// Tells whether all its threads keep their promises to the watchdog.
  [[nodiscard]] bool kept() const;
  [[nodiscard]] ScanTotals totals() const { return statistics_.totals(); }
  /// A scan's cloud was handed to a client's socket, so long after the last byte of its frames was there.
  void note_latency(std::chrono::nanoseconds time) { statistics_.note_latency(time); }
  /// The drift of the calibration that the scans show, one per configured camera; empty before the first scan.
  [[nodiscard]] std::vector<DriftState> drifts() const { return watch_.states(); }
  [[nodiscard]] const BlackBox& black_box() const { return black_box_; }  ///< its figures are for metrics
  [[nodiscard]] const Rig& rig() const { return *rig_; }                  ///< its statuses are for clients

  /// Ends what is under way, soon, and the threads; requests that wait are answered kCancelled.
  void request_stop();
  /// Tells whether the threads came to their ends, and the cameras are closed, within the time.
  [[nodiscard]] bool wait_stopped(std::chrono::milliseconds time);

 private:
  /// A task and what is to be done when its turn comes.
  struct Turn {
    std::shared_ptr<Task> task;
    std::function<void()> take;
  };
  /// Called once with permission to work, or with the reason why there is none.
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
                                       const std::vector<CameraOptions>& wanted);
  [[nodiscard]] std::shared_ptr<Scan> make_scan(ScanRequest request, bool listened, Answer<ScanResult> answer);
  [[nodiscard]] Patience patience_of(Task& task);
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
  std::mutex concluding_;  ///< guards skipped_told_, and keeps the log's lines in the order of the totals
  std::uint64_t skipped_told_ = 0;
  std::atomic<int> failures_in_a_row_{0};
  std::atomic<bool> empty_told_{false};  ///< the log has the cause of empty clouds
  std::atomic<double> free_rate_hz_{0};  ///< 0: only when asked
  std::atomic<CloudFormats> free_formats_{};
  MonotonicTime next_free_scan_{};
  bool every_frame_ = false;  ///< the next free scan is due when the one before is captured
  std::atomic<int> running_{2};
  DecodeLanes lanes_;
  Deadlines deadlines_;
  std::jthread chores_thread_;
  std::jthread thread_;
};

}  // namespace slsd
