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
  std::string model = {};   ///< as the monitor's EDID says, once it is open; empty: unknown
  std::string serial = {};  ///< likewise; empty: none
};

/// A projector that shows one image, pixel for pixel. Backends: headless, glfw. Every backend passes the suite
/// in tests/drivers.
/// After kDisconnected it needs open(), and then shows black until show().
/// @thread thread-bound
class Projector {
 public:
  virtual ~Projector() = default;
  [[nodiscard]] virtual const ProjectorDescription& description() const = 0;

  /// Opens the projector, again after a fault, and shows black.
  /// @errors kNotFound, kPermissionDenied, kMismatch, kUnsupported, kDisconnected
  [[nodiscard]] virtual Result<> open() = 0;

  /// Shows the image from now on; waits for its first whole refresh to be complete, from the first row to the last, and
  /// returns when that was. How long the device itself takes from there to its light, no driver knows.
  /// @errors kMismatch: not of the projector's size; kDisconnected
  [[nodiscard]] virtual Result<MonotonicTime> show(const Grey8& image) = 0;

  /// Whether it still shows what it was told to, now; waits for no refresh. Asked before and after each frame of a
  /// scan, and while nobody scans. @errors kDisconnected
  [[nodiscard]] virtual Result<> check() = 0;

  /// What disturbs the light that it gives, as found by open(): a sentence each, with the remedy.
  [[nodiscard]] virtual std::vector<std::string> warnings() const = 0;

  /// What is shown, as read back from where it is shown. @errors kDisconnected
  [[nodiscard]] virtual Result<Grey8> read_back() = 0;
};

}  // namespace slsd
