// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <string>

#include "core/result.hpp"
#include "drivers/camera/frame.hpp"

namespace slsd {

struct CameraDescription {
  std::string name;    ///< as configured
  std::string driver;  ///< "file", ...
  std::string device;  ///< stable name of the device: path, serial number
  int width_px = 0;
  int height_px = 0;
};

/// A camera that takes one frame to a trigger. Backends: file. Every backend passes the suite in tests/drivers.
/// Frames may outlive the camera.
///
///     made --open()--> ready --capture(): kDisconnected--> gone --open()--> ready
///                      ready --capture(): any other-----> ready
///
/// @thread thread-bound, but for cancel()
class Camera {
 public:
  virtual ~Camera() = default;

  /// Width and height are known after open(), and zero before.
  [[nodiscard]] virtual const CameraDescription& description() const = 0;

  /// Opens the device, again after a fault; configures everything anew and starts the sequence numbers at 0.
  /// @errors kNotFound, kPermissionDenied, kMalformed, kUnsupported, kDisconnected: the device's supervisor retries
  [[nodiscard]] virtual Result<> open() = 0;

  /// Exposes one frame that begins after the call, and waits for it until the deadline at most.
  /// @errors kFrameDropped, kFrameTorn, kFrameStale, kFrameLate: this frame is lost, the camera goes on;
  ///         kBusy: too many frames are held, give one back; kDisconnected: it needs open(); kCancelled; any other: as
  ///         the backend documents, this frame is lost
  [[nodiscard]] virtual Result<Frame> capture(MonotonicTime deadline) = 0;

  /// Ends the capture() that waits on another thread, soon, with kCancelled; where none waits, ends the next one, so
  /// that a cancel() that comes just before it is not lost. open() forgets it.
  /// @thread thread-safe
  virtual void cancel() = 0;
};

}  // namespace slsd
