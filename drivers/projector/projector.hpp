// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include "core/image.hpp"
#include "core/result.hpp"
#include "drivers/camera/frame.hpp"

namespace slsd {

struct ProjectorDescription {
  std::string driver;
  std::string monitor;
  int width_px = 0;
  int height_px = 0;
  std::string model = {};   ///< model in the monitor's EDID, once it is open; empty: unknown
  std::string serial = {};  ///< likewise; empty: none
};

/// A projector that shows one image, pixel for pixel. Backends: headless, glfw. Every backend passes the suite
/// in tests/drivers.
///
/// No call waits for longer than its deadline, whatever the device and its driver do. What is not done by then goes on:
/// that is kTimeout, and the same call, made again, waits for it. A driver that has not answered for seconds hangs:
/// that is kIo, which every call says at once until the driver answers. After kDisconnected and kIo it needs open().
/// @thread thread-bound
class Projector {
 public:
  virtual ~Projector() = default;
  [[nodiscard]] virtual const ProjectorDescription& description() const = 0;

  /// Opens the projector, again after a fault, and shows black; after a driver only was slow or hung, what it was told.
  /// @errors kNotFound, kPermissionDenied, kMismatch, kUnsupported, kDisconnected, kTimeout, kIo
  [[nodiscard]] virtual Result<> open(MonotonicTime deadline) = 0;

  /// Shows the image from now on; waits for its first whole refresh to be complete, from the first row to the last, and
  /// returns when that was. How long the device itself takes from there to its light, no driver knows.
  /// @errors kMismatch: not of the projector's size; kDisconnected, kTimeout, kIo
  [[nodiscard]] virtual Result<MonotonicTime> show(const Grey8& image, MonotonicTime deadline) = 0;

  /// Checks that it still shows what it was told to, now; waits for no refresh. Called before and after each frame of a
  /// scan, and while nobody scans. @errors kDisconnected, kTimeout, kIo
  [[nodiscard]] virtual Result<> check(MonotonicTime deadline) = 0;

  /// Warnings about disturbances of its light, as found by open(). Each is one sentence with the remedy.
  [[nodiscard]] virtual std::vector<std::string> warnings() const = 0;

  /// Reads back the shown image from the place that shows it; for tests. @errors kDisconnected, kIo
  [[nodiscard]] virtual Result<Grey8> read_back() = 0;
};

}  // namespace slsd
