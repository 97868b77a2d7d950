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
  double rate_hz = 0.0;  ///< frame rate while it runs freely, after open(); 0: exposes at the trigger, or does not tell
  std::string hardware = {};  ///< after open(): what tells the device from others of its kind, wherever it is plugged
                              ///< in; printable, at most 200 bytes; empty where nothing does
  bool external_trigger = false;  ///< exposes when a line outside of this host says so: it may be silent for long
};

/// A number that a driver keeps of its own: "packets_sent_again", "clock_drift_ppm".
struct DriverFigure {
  std::string_view name;  ///< lives as long as the program
  double value = 0.0;
  bool counts = true;  ///< only grows, until the device is opened anew; else it is what it is now
};

/// A camera that takes one frame to a trigger. Backends: file, v4l2, aravis. Every backend passes the suite in
/// tests/drivers. Frames may outlive the camera.
///
///     made --open()--> ready --capture(): kDisconnected--> gone --open()--> ready
///                      ready --check(): kDisconnected---> gone
///                      ready --capture(): any other-----> ready
///
/// @thread thread-bound, but for cancel()
class Camera {
 public:
  virtual ~Camera() = default;

  /// Width and height are known after open(), and zero before.
  [[nodiscard]] virtual const CameraDescription& description() const = 0;

  /// Called by open() as soon as something of the camera's name answers, before it is configured. Set before the first
  /// open(); a backend that opens at once need not call it.
  virtual void set_found(std::function<void()> /*found*/) {}  // NOLINT: those that keep it take it over

  /// Opens the device, again after a fault; configures everything anew and starts the sequence numbers at 0.
  /// @errors kNotFound, kPermissionDenied, kMalformed, kUnsupported, kDisconnected: the device's supervisor retries;
  ///         kCancelled: a cancel() came meanwhile
  [[nodiscard]] virtual Result<> open() = 0;

  /// The longest time that open() may take, for the thread that watches over it.
  [[nodiscard]] virtual std::chrono::nanoseconds open_time_max() const { return std::chrono::minutes(1); }

  /// The longest time that capture() may take if nothing is wrong, whatever its deadline. The thread that watches over
  /// it asks again after that, and takes a driver that does not come back for stuck.
  [[nodiscard]] virtual std::chrono::nanoseconds frame_time_max() const {
    constexpr double kFloorS = 5;
    const double rate_hz = description().rate_hz;
    const double seconds = rate_hz > 0 ? std::max(kFloorS, 3 / rate_hz) : kFloorS;
    return std::chrono::nanoseconds(static_cast<std::int64_t>(std::min(seconds, 3600.0) * 1e9));
  }

  /// Exposes one frame that begins after the call, and waits for it until the deadline at most.
  /// @errors kFrameDropped, kFrameTorn, kFrameStale, kFrameLate: this frame is lost, the camera goes on;
  ///         kBusy: too many frames are held, give one back; kDisconnected: it needs open(); kCancelled; any other: as
  ///         the backend documents, this frame is lost
  [[nodiscard]] virtual Result<Frame> capture(MonotonicTime deadline) = 0;

  /// The frame after the one that was given last, for a rig that stands still and wants every frame: its exposure may
  /// have begun before the call, but not before that of the one given last. After a pause of more than a few periods,
  /// and of a camera that exposes at the trigger, as capture(). @errors as capture()
  [[nodiscard]] virtual Result<Frame> capture_next(MonotonicTime deadline) { return capture(deadline); }

  /// Tells the light of the captures that follow; the default is the pattern. A camera sees it, a replay chooses its
  /// images by it.
  virtual void expect(Picture) {}

  /// Checks that the open device is still there, as far as can be told without a frame and without waiting.
  /// @errors kDisconnected: it needs open()
  [[nodiscard]] virtual Result<> check() { return {}; }

  /// Appends what the driver counts besides frames delivered and lost.
  virtual void tell_figures(std::vector<DriverFigure>& /*figures*/) const {}

  /// Ends the capture() that waits on another thread, soon, with kCancelled; where none waits, ends the next one, so
  /// that a cancel() that comes just before it is not lost. open() forgets it; one that comes while a backend waits
  /// in open() may end that, too.
  /// @thread thread-safe
  virtual void cancel() = 0;
};

}  // namespace slsd
