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
/// @thread thread-bound, but for cancel()
class Camera {
 public:
  virtual ~Camera() = default;

  [[nodiscard]] virtual const CameraDescription& description() const = 0;

  /// Opens the device, again after a fault; configures everything anew.
  /// @errors kNotFound, kPermissionDenied, kMalformed, kUnsupported, kDisconnected: the device's supervisor retries
  [[nodiscard]] virtual Result<> open() = 0;

  /// Exposes one frame that begins after the call, and waits for it.
  /// @errors kFrameDropped, kFrameTorn, kFrameStale, kFrameLate: this frame is lost, the camera goes on;
  ///         kDisconnected: it needs open(); kCancelled
  [[nodiscard]] virtual Result<Frame> capture(MonotonicTime deadline) = 0;

  /// Ends a capture() that is waiting on another thread, soon, with kCancelled. @thread thread-safe
  virtual void cancel() = 0;
};

}  // namespace slsd
