// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "core/cloud/cloud.hpp"

namespace slsd {

/// A field of a point as PLY and PCD store it.
struct PointField {
  std::string_view name;
  std::string_view ply_type;
  char pcd_type;  ///< F, U or I
  int bytes;
};

inline constexpr std::array<PointField, 13> kPointFields{{{"x", "float", 'F', 4},
                                                          {"y", "float", 'F', 4},
                                                          {"z", "float", 'F', 4},
                                                          {"intensity", "uchar", 'U', 1},
                                                          {"camera_u", "float", 'F', 4},
                                                          {"camera_v", "float", 'F', 4},
                                                          {"projector_u", "float", 'F', 4},
                                                          {"projector_v", "float", 'F', 4},
                                                          {"camera", "uchar", 'U', 1},
                                                          {"symbol", "uchar", 'U', 1},
                                                          {"sigma_mm", "float", 'F', 4},
                                                          {"column", "int", 'I', 4},
                                                          {"row", "int", 'I', 4}}};

/// Bytes of one point: the fields in their order, little endian, nothing between them.
inline constexpr std::size_t kPointBytes = 43;

/// Appends the kPointBytes of a point.
void append_point(const CloudPoint& point, std::string& bytes);

/// The point that append_point() wrote; nothing where its cell is none.
/// @param bytes  at least kPointBytes
[[nodiscard]] std::optional<CloudPoint> read_point(const char* bytes);

/// sigma_calibration_mm as a header names it: "0.213", or empty.
[[nodiscard]] std::string sigma_calibration_text(const Cloud& cloud);

/// A text fit for a line of a header: control characters become spaces.
[[nodiscard]] std::string header_text(std::string_view text);

}  // namespace slsd
