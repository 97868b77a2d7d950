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
  std::string serial = {};  ///< from the EDID too; empty: none
};

/// A projector that shows one image, pixel for pixel. Backends: headless, glfw. Every backend passes the suite in
/// tests/drivers.
///
/// No call waits beyond its deadline, whatever the device and its driver do. Unfinished work continues: the call
/// returns kTimeout, and the same call, made again, waits for it. A driver that has not answered for seconds hangs.
/// Then every call returns kIo at once until the driver answers. After kDisconnected and kIo, call open().
/// @thread thread-bound
class Projector {
 public:
  virtual ~Projector() = default;
  [[nodiscard]] virtual const ProjectorDescription& description() const = 0;

  /// Opens the projector, also after a fault, and shows black. If the driver was only slow or hung, shows its last
  /// image again.
  /// @errors kNotFound, kPermissionDenied, kMismatch, kUnsupported, kDisconnected, kTimeout, kIo
  [[nodiscard]] virtual Result<> open(MonotonicTime deadline) = 0;

  /// Shows the image, waits for its first complete refresh from the first row to the last, and returns the time of its
  /// end. No driver knows the device's own delay from there to its light.
  /// @errors kMismatch: not in the projector's size; kDisconnected, kTimeout, kIo
  [[nodiscard]] virtual Result<MonotonicTime> show(const Grey8& image, MonotonicTime deadline) = 0;

  /// Checks that the projector still shows its image; waits for no refresh. Called before and after each frame of a
  /// scan, and while nobody scans. @errors kDisconnected, kTimeout, kIo
  [[nodiscard]] virtual Result<> check(MonotonicTime deadline) = 0;

  /// Warnings of open() about disturbances of the light. Each is one sentence with the remedy.
  [[nodiscard]] virtual std::vector<std::string> warnings() const = 0;

  /// Reads the image back from where it is shown; for tests. @errors kDisconnected, kIo
  [[nodiscard]] virtual Result<Grey8> read_back() = 0;
};

}  // namespace slsd
