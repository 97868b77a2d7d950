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
  int ply_bytes;
  char pcd_type;  ///< F, U or I
  int pcd_bytes;
};

inline constexpr std::array<PointField, 13> kPointFields{{{"x", "float", 4, 'F', 4},
                                                          {"y", "float", 4, 'F', 4},
                                                          {"z", "float", 4, 'F', 4},
                                                          {"intensity", "uchar", 1, 'F', 4},
                                                          {"camera_u", "float", 4, 'F', 4},
                                                          {"camera_v", "float", 4, 'F', 4},
                                                          {"projector_u", "float", 4, 'F', 4},
                                                          {"projector_v", "float", 4, 'F', 4},
                                                          {"camera", "uchar", 1, 'U', 1},
                                                          {"symbol", "uchar", 1, 'U', 1},
                                                          {"sigma_mm", "float", 4, 'F', 4},
                                                          {"column", "int", 4, 'I', 4},
                                                          {"row", "int", 4, 'I', 4}}};

/// The fields of a coloured cloud after these. In a PCD one field holds them, as PCL's PointXYZRGB has it: 0, red,
/// green and blue, from the highest byte.
inline constexpr std::string_view kPlyColourLines = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
inline constexpr PointField kPcdColour{"rgb", "", 0, 'F', 4};
inline constexpr std::size_t kPlyColourBytes = 3, kPcdColourBytes = 4;

/// Bytes of one point in a PLY: the fields in order, little endian, without padding.
inline constexpr std::size_t kPointBytes = 43;
/// Bytes of one point in a PCD, where intensity is a float: PCL's PointXYZI accepts nothing else.
inline constexpr std::size_t kPcdPointBytes = 46;

/// Appends the kPointBytes of a point.
void append_point(const CloudPoint& point, std::string& bytes);

/// Appends the kPcdPointBytes of a point.
void append_pcd_point(const CloudPoint& point, std::string& bytes);

/// Appends the bytes of a colour in a PLY or PCD.
void append_colour(const Rgb& colour, std::string& bytes);
void append_pcd_colour(const Rgb& colour, std::string& bytes);

/// Reads a point that append_point() wrote; empty if its cell is invalid.
/// @param bytes  at least kPointBytes
[[nodiscard]] std::optional<CloudPoint> read_point(const char* bytes);

/// sigma_calibration_mm as text in a header: "0.213", or empty.
[[nodiscard]] std::string sigma_calibration_text(const Cloud& cloud);

/// Makes a text fit a header's line: control characters become spaces.
[[nodiscard]] std::string header_text(std::string_view text);

}  // namespace slsd
