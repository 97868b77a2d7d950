// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/result.hpp"
#include "drivers/camera/aravis/aravis_camera_options.hpp"
#include "drivers/camera/aravis/frame_counts.hpp"
#include "drivers/camera/camera.hpp"

namespace slsd {

class AravisSession;
class CaptureEvents;

/// A GigE Vision or USB3 Vision camera, by Aravis. A frame is a lease on the stream's own buffer; only mosaics are
/// turned into grey in a buffer of this driver's.
///
/// A frame is handed out only if it is whole, of the size configured, and its exposure began after capture() was
/// called. When that was is told by the device's clock, which is read every second; many cameras stamp the exposure's
/// start, some the start of its readout; one that has chunks tells the start in them. By its chunks too a frame is
/// refused that was exposed with other settings than configured.
///
/// Threads of its own: "aravis control", which talks to the device so that a device which is gone holds up no capture;
/// Aravis' own for stream and heartbeat; and one to close a session with a device that is gone, which takes seconds.
/// @thread thread-bound, but for cancel()
class AravisCamera final : public Camera {
 public:
  explicit AravisCamera(AravisCameraOptions options);
  ~AravisCamera() override;
  AravisCamera(const AravisCamera&) = delete;
  AravisCamera& operator=(const AravisCamera&) = delete;

  [[nodiscard]] const CameraDescription& description() const override { return description_; }
  void set_found(std::function<void()> found) override { found_ = std::move(found); }
  /// Also proves that frames arrive. Warnings about the system are logged, each once.
  /// @errors kInvalidArgument (an option), kNotFound, kPermissionDenied (another application controls it), kMismatch
  ///         (it took another value than the one configured), kUnsupported, kDisconnected; kCancelled
  [[nodiscard]] Result<> open() override;
  [[nodiscard]] std::chrono::nanoseconds open_time_max() const override;
  [[nodiscard]] std::chrono::nanoseconds frame_time_max() const override;
  /// kDisconnected also after missed_frames_max frames in a row did not come.
  /// @errors kMismatch: the frame was exposed with other settings than configured, and is lost; as Camera::capture()
  [[nodiscard]] Result<Frame> capture(MonotonicTime deadline) override;
  [[nodiscard]] Result<Frame> capture_next(MonotonicTime deadline) override;
  /// Tells what the camera's own clock, which is read every second, or its heartbeat found out.
  [[nodiscard]] Result<> check() override;
  void tell_figures(std::vector<DriverFigure>& figures) const override;
  void cancel() override;

  /// The statistics of the open session, or of the one before.
  [[nodiscard]] AravisStatistics statistics() const;
  /// The rate by which the device's clock is faster than the host's; 0 until it is known.
  [[nodiscard]] double clock_drift_ppm() const;
  /// The names of what on this system may cost frames, or could not be made sure of: "receive_buffer", "packet_size",
  /// "fragments", "packet_resend", "device_clock", "chunks", "first_frame".
  [[nodiscard]] std::vector<std::string> warnings() const;

 private:
  void end_session();
  void log_warnings();
  [[nodiscard]] Result<Frame> note(Result<Frame> frame);

  AravisCameraOptions options_;
  CameraDescription description_;
  std::function<void()> found_;
  std::unique_ptr<CaptureEvents> events_;
  std::unique_ptr<AravisSession> session_;
  AravisStatistics ended_;
  std::optional<MonotonicTime> last_start_;  ///< start of the previous frame's exposure
  std::string address_;
  std::vector<std::string> logged_;
  std::vector<std::jthread> closing_;
};

}  // namespace slsd
