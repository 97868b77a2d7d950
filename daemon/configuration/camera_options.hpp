// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "drivers/camera/aravis/aravis_camera_options.hpp"
#include "drivers/camera/fault.hpp"
#include "drivers/camera/file_camera.hpp"
#include "drivers/camera/v4l2/v4l2_camera_options.hpp"

namespace slsd {

enum class CameraDriver { kFile, kV4l2, kAravis };
[[nodiscard]] std::string_view to_string(CameraDriver driver);

/// A [[camera]] table.
struct CameraOptions {
  CameraDriver driver = CameraDriver::kFile;
  FileCameraOptions file;      ///< its name is the camera's, whatever the driver
  V4l2CameraOptions v4l2;      ///< where it is the driver
  AravisCameraOptions aravis;  ///< where it is the driver
  std::vector<Fault> faults;   ///< what the camera does wrong, for the tests of everything above it

  [[nodiscard]] const std::string& name() const { return file.name; }
  /// As configured; nothing where the driver keeps the camera's own, or has none.
  [[nodiscard]] std::optional<double> exposure_us() const;
  /// Of its pixels, by the driver's name for it; empty where the driver chooses.
  [[nodiscard]] std::string format() const;
  /// @errors kInvalidArgument: the message begins with the key
  [[nodiscard]] Result<> validate() const;
  friend bool operator==(const CameraOptions&, const CameraOptions&) = default;
};

}  // namespace slsd
