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
#include "drivers/camera/aravis/frames/frame_counts.hpp"
#include "drivers/camera/camera.hpp"

namespace slsd {

class AravisSession;
class CaptureEvents;

/// A GigE Vision or USB3 Vision camera through Aravis. A frame is a lease on the stream's own buffer. Only mosaics and
/// packed pixels are converted, into a buffer of this driver.
///
/// Delivers only whole frames of the configured size whose exposure began after the call of capture(). The device's
/// clock, read every second, tells when that was. Many cameras stamp the start of the exposure, some the start of the
/// readout; chunks contain the start of the exposure. If chunks show other settings than configured, the frame is
/// refused too.
///
/// Has threads of its own. "aravis control" talks to the device, so that a lost device delays no capture. Aravis has
/// its own threads for stream and heartbeat. One more closes a session with a lost device, which takes seconds.
/// @thread thread-bound, except cancel()
class AravisCamera final : public Camera {
 public:
  explicit AravisCamera(AravisCameraOptions options);
  ~AravisCamera() override;
  AravisCamera(const AravisCamera&) = delete;
  AravisCamera& operator=(const AravisCamera&) = delete;

  [[nodiscard]] const CameraDescription& description() const override { return description_; }
  void set_found(std::function<void()> found) override { found_ = std::move(found); }
  /// Also verifies that frames arrive. Logs each warning about the system once.
  /// @errors kInvalidArgument (an option), kNotFound, kPermissionDenied (another application controls the camera),
  ///         kMismatch (the camera took another value than configured), kUnsupported, kDisconnected; kCancelled
  [[nodiscard]] Result<> open() override;
  [[nodiscard]] std::chrono::nanoseconds open_time_max() const override;
  [[nodiscard]] std::chrono::nanoseconds frame_time_max() const override;
  /// Also gives kDisconnected after missed_frames_max missing frames in a row.
  /// @errors kMismatch: the frame was exposed with other settings than configured, and is lost; as Camera::capture()
  [[nodiscard]] Result<Frame> capture(MonotonicTime deadline) override;
  [[nodiscard]] Result<Frame> capture_next(MonotonicTime deadline) override;
  void expect(Picture light) override;
  /// Makes the next capture in free run pass over one frame more, because some cameras expose that one as before.
  [[nodiscard]] Result<> set_exposure(double exposure_us) override;
  /// Reports what the device's clock, read every second, or the heartbeat has detected.
  [[nodiscard]] Result<> check() override;
  void tell_figures(std::vector<DriverFigure>& figures) const override;
  void cancel() override;

  /// The statistics of the open session, or of the previous one.
  [[nodiscard]] AravisStatistics statistics() const;
  /// The drift of the device's clock against the host's, in parts per million, faster is positive; 0 until known.
  [[nodiscard]] double clock_drift_ppm() const;
  /// The names of system properties that may cost frames, or could not be verified: "receive_buffer", "packet_size",
  /// "fragments", "packet_resend", "device_clock", "chunks", "first_frame".
  [[nodiscard]] std::vector<std::string> warnings() const;

 private:
  void end_session();
  void log_warnings();
  [[nodiscard]] Result<Frame> note(Result<Frame> frame);
  [[nodiscard]] Result<> pass_over(MonotonicTime deadline);

  AravisCameraOptions options_;
  CameraDescription description_;
  std::function<void()> found_;
  std::unique_ptr<CaptureEvents> events_;
  std::unique_ptr<AravisSession> session_;
  AravisStatistics ended_;
  std::optional<MonotonicTime> last_start_;  ///< start of the previous frame's exposure
  bool exposure_changed_ = false;            ///< the next frame in free run may have the exposure before
  std::string address_;
  std::vector<std::string> logged_;
  std::vector<std::jthread> closing_;
};

}  // namespace slsd
