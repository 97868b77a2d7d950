// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/image.hpp"

namespace slsd {

/// One measured symbol. Coordinates in the rig frame (that of the first camera), millimetres.
struct CloudPoint {
  float x = 0, y = 0, z = 0;
  float camera_u = 0, camera_v = 0;        ///< px, distorted, as observed
  float projector_u = 0, projector_v = 0;  ///< px, distorted, as observed
  float sigma_mm = 0;                      ///< one standard deviation along the camera's ray
  std::uint16_t column = 0, row = 0;       ///< cell of the pattern
  std::uint8_t intensity = 0;
  std::uint8_t camera = 0;  ///< index in the calibration
  std::uint8_t symbol = 0;  ///< 1 to 25
  Rgb colour{};             ///< of the surface under white light; meaningful if the cloud is coloured
  friend bool operator==(const CloudPoint&, const CloudPoint&) = default;
};

struct Cloud {
  std::vector<CloudPoint> points;
  int lattice_columns = 0;  ///< fully visible columns of the pattern's cells
  int lattice_rows = 0;
  int cameras = 1;
  std::string scan_id;
  std::string time;         ///< ISO 8601, UTC; when the exposure began
  std::uint64_t frame = 0;  ///< sequence number of the first camera's frame
  bool coloured = false;    ///< its points have colours, also in files
  /// One standard deviation of the depth, from the calibration's own uncertainty, if the calibration states it. This
  /// error moves the cloud as a whole, and no point relative to another.
  std::optional<float> sigma_calibration_mm;
  friend bool operator==(const Cloud&, const Cloud&) = default;
};

}  // namespace slsd
