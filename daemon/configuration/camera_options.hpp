// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/colour.hpp"
#include "core/result.hpp"
#include "drivers/camera/aravis/aravis_camera_options.hpp"
#include "drivers/camera/fault.hpp"
#include "drivers/camera/file_camera.hpp"
#include "drivers/camera/v4l2/v4l2_camera_options.hpp"

namespace slsd {

/// The visitor for std::visit with one function per driver's options. A forgotten driver does not compile.
template <class... Visits>
struct Overloaded : Visits... {
  using Visits::operator()...;
};
template <class... Visits>
Overloaded(Visits...) -> Overloaded<Visits...>;

/// The purpose of a camera.
enum class CameraUse {
  kPoints,   ///< it is decoded, and may give colours, too
  kTexture,  ///< it gives only the colours of points that others measure
};

/// A [[camera]] table: the keys of its driver, and the keys common to all drivers.
struct CameraOptions {
  std::variant<FileCameraOptions, V4l2CameraOptions, AravisCameraOptions> of_driver;
  std::vector<Fault> faults;  ///< simulated faults, for tests of the code above the camera
  /// Two exposures of each picture, to be merged; the driver opens with the first. Empty: one exposure.
  std::vector<double> exposures_us = {};
  /// Factors of the colours of clouds.
  ColourGains white_balance = {1, 1, 1};
  CameraUse use = CameraUse::kPoints;

  [[nodiscard]] const std::string& name() const;
  [[nodiscard]] std::string_view driver() const;  ///< "file", "v4l2" or "aravis"
  /// The configured exposure. Empty if the driver keeps the camera's own value or has none.
  [[nodiscard]] std::optional<double> exposure_us() const;
  /// Sets two exposures, and the shorter one as the driver's own.
  void set_exposures(std::vector<double> exposures_us);
  [[nodiscard]] std::optional<double> gain_db() const;
  /// The pixel format, in the driver's words. Empty if the driver chooses.
  [[nodiscard]] std::string format() const;
  /// Tells whether the frames come from files: then no device is needed.
  [[nodiscard]] bool replays() const { return std::holds_alternative<FileCameraOptions>(of_driver); }
  [[nodiscard]] bool measures() const { return use == CameraUse::kPoints; }
  /// @errors kInvalidArgument: the message begins with the key
  [[nodiscard]] Result<> validate() const;
  friend bool operator==(const CameraOptions&, const CameraOptions&) = default;
};

}  // namespace slsd
