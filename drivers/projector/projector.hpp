// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/image.hpp"
#include "core/result.hpp"
#include "drivers/camera/frame.hpp"

namespace slsd {

struct ProjectorDescription {
  std::string driver;
  std::string monitor;
  int width_px = 0;
  int height_px = 0;
};

/// A projector that shows one image, pixel for pixel. Backends: headless. Every backend passes the suite in
/// tests/drivers.
/// @thread thread-bound
class Projector {
 public:
  virtual ~Projector() = default;
  [[nodiscard]] virtual const ProjectorDescription& description() const = 0;

  /// @errors kNotFound, kPermissionDenied, kMismatch, kUnsupported, kDisconnected
  [[nodiscard]] virtual Result<> open() = 0;

  /// Shows the image from now on; returns when its first complete refresh began.
  /// @errors kMismatch: not of the projector's size; kDisconnected
  [[nodiscard]] virtual Result<MonotonicTime> show(const Grey8& image) = 0;

  /// What is shown, as read back from where it is shown. @errors kDisconnected
  [[nodiscard]] virtual Result<Grey8> read_back() = 0;
};

}  // namespace slsd
