// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "core/shown_picture.hpp"
#include "drivers/camera/frame.hpp"

namespace slsd {

struct CameraDescription {
  std::string name;    ///< configured name
  std::string driver;  ///< "file", "v4l2" or "aravis"
  std::string device;  ///< stable name of the device: path, serial number
  int width_px = 0;
  int height_px = 0;
  double rate_hz = 0.0;       ///< frame rate in free run, after open(); 0: exposes at the trigger, or unknown
  std::string hardware = {};  ///< after open(): identifies the device wherever it is plugged in; printable, at most 200
                              ///< bytes; empty if unknown
  bool external_trigger = false;  ///< an external signal triggers it, so it may be silent for long
};

/// A figure that a driver keeps on its own: "packets_sent_again", "clock_drift_ppm".
struct DriverFigure {
  std::string_view name;  ///< lives until the program ends
  double value = 0.0;
  bool counts = true;  ///< a count that grows until the device is reopened; else a current value
};

/// A camera that takes one frame for each trigger. Backends: file, v4l2, aravis. Every backend passes the suite in
/// tests/drivers. Frames may outlive the camera.
///
///     made --open()--> ready --capture(): kDisconnected--> gone --open()--> ready
///                      ready --check(): kDisconnected---> gone
///                      ready --capture(): any other-----> ready
///
/// @thread thread-bound, except cancel()
class Camera {
 public:
  virtual ~Camera() = default;

  /// Width and height are known after open(), and zero before.
  [[nodiscard]] virtual const CameraDescription& description() const = 0;

  /// Called by open() as soon as a device of the camera's name answers, before its configuration. Set before the first
  /// open(). A backend that opens at once need not call it.
  virtual void set_found(std::function<void()> /*found*/) {}  // NOLINT: those that keep it take it over

  /// Opens the device, also after a fault. Configures everything again and restarts the sequence numbers at 0.
  /// @errors kNotFound, kPermissionDenied, kMalformed, kUnsupported, kDisconnected: the device's supervisor retries;
  ///         kCancelled: cancel() was called meanwhile
  [[nodiscard]] virtual Result<> open() = 0;

  /// The longest time that open() may take; its watchdog uses this.
  [[nodiscard]] virtual std::chrono::nanoseconds open_time_max() const { return std::chrono::minutes(1); }

  /// The longest time of a normal capture(), whatever its deadline. The watching thread asks again after that time, and
  /// considers a driver that does not return stuck.
  [[nodiscard]] virtual std::chrono::nanoseconds frame_time_max() const {
    constexpr double kFloorS = 5;
    const double rate_hz = description().rate_hz;
    const double seconds = rate_hz > 0 ? std::max(kFloorS, 3 / rate_hz) : kFloorS;
    return std::chrono::nanoseconds(static_cast<std::int64_t>(std::min(seconds, 3600.0) * 1e9));
  }

  /// Exposes one frame after the call, and waits for it until the deadline at most.
  /// @errors kFrameDropped, kFrameTorn, kFrameStale, kFrameLate: this frame is lost, the camera continues; kBusy: too
  ///         many frames are held, give one back; kDisconnected: call open(); kCancelled; any other: as the backend
  ///         documents, this frame is lost
  [[nodiscard]] virtual Result<Frame> capture(MonotonicTime deadline) = 0;

  /// Captures the frame after the previous one, for a rig that stands still and needs every frame. Its exposure may
  /// have begun before the call, but not before the previous frame's. Works as capture() after a pause of more than a
  /// few periods, and for a triggered camera. @errors as capture()
  [[nodiscard]] virtual Result<Frame> capture_next(MonotonicTime deadline) { return capture(deadline); }

  /// Sets the light of the next captures; the default is the pattern. A replay chooses its images accordingly. A camera
  /// that sees colours adds them to its frames without the pattern.
  virtual void expect(Picture) {}

  /// Sets the exposure of the next captures of an open camera. They wait for frames that were exposed with it.
  /// @param exposure_us  a configured one; the camera opens with the first
  /// @errors kUnsupported: the driver has no exposure; kMismatch: the device did not take it; kDisconnected: call
  /// open()
  [[nodiscard]] virtual Result<> set_exposure(double /*exposure_us*/) {
    return fail(ErrorCode::kUnsupported, "this camera cannot change its exposure; remove exposures_us");
  }

  /// Checks that the open device is still present, as far as possible without a frame and without waiting.
  /// @errors kDisconnected: call open()
  [[nodiscard]] virtual Result<> check() { return {}; }

  /// Appends the driver's own figures, beyond frames delivered and lost.
  virtual void tell_figures(std::vector<DriverFigure>& /*figures*/) const {}

  /// Soon ends a capture() that waits on another thread, with kCancelled. If none waits, ends the next one, so that a
  /// cancel() just before it is not lost. open() clears it. A cancel() while a backend waits in open() may end that
  /// too.
  /// @thread thread-safe
  virtual void cancel() = 0;
};

}  // namespace slsd
