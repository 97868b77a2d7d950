// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/cloud/cloud.hpp"
#include "core/cloud/point_grid.hpp"
#include "core/geometry/calibration.hpp"
#include "core/result.hpp"

namespace slsd {

// Files of dense clouds, as in docs/formats.md: binary, little-endian. A record is x, y, z and sigma_mm as floats, the
// intensity, the camera's index as a byte, with normals three floats more, and with colours those of point_record.hpp.

inline constexpr std::size_t kDensePlyBytes = 18;     ///< of a record without a normal; the intensity is a byte
inline constexpr std::size_t kDensePcdBytes = 21;     ///< the same in a PCD; the intensity is a float, which PCL needs
inline constexpr std::size_t kDenseNormalBytes = 12;  ///< of a normal

/// Facts about a dense cloud in a file's header.
struct DenseFacts {
  std::string scan_id;
  std::string time;         ///< ISO 8601, UTC
  std::uint64_t frame = 0;  ///< sequence number of the first camera's frame
  std::size_t cameras = 1;
  bool normals = false;
  std::optional<RigidTransform> base_from_rig = {};  ///< the points are in the robot's base; empty: in the rig's frame
  bool coloured = false;
};

/// @param points  number of records that follow
[[nodiscard]] std::string dense_ply_header(const DenseFacts& facts, std::size_t points);
/// @param width, height  size of the organised cloud; width * height records follow
[[nodiscard]] std::string dense_pcd_header(const DenseFacts& facts, int width, int height);

/// Bytes of a record of each format.
[[nodiscard]] std::size_t dense_ply_bytes(bool normals, bool coloured);
[[nodiscard]] std::size_t dense_pcd_bytes(bool normals, bool coloured);

/// An organised cloud, read where it lies in memory.
class DensePcd {
 public:
  /// @param bytes   the file, as dense_pcd_header() begins it; must outlive this object
  /// @param height  rows of the organised cloud
  /// @errors kMalformed: no such header, or too few records
  [[nodiscard]] static Result<DensePcd> open(std::string_view bytes, int height, bool normals);

  /// base_from_rig of the file; empty: its points are in the rig's frame.
  [[nodiscard]] const std::optional<RigidTransform>& base_from_rig() const { return base_from_rig_; }
  /// Converts to a PLY in the same frame, without the pixels that are not measured. Counts the cameras itself.
  [[nodiscard]] std::string to_ply(const DenseFacts& facts) const;
  /// All pixels, measured or not, in the rig's frame.
  [[nodiscard]] PointGrid grid() const;
  /// Every step-th pixel of every step-th row as a point whose column and row are its place in that lattice, as far as
  /// it lies in front of the first camera. In the rig's frame.
  [[nodiscard]] Cloud lattice(int step) const;

 private:
  DensePcd(std::string_view records, int width, int height, bool normals, bool coloured)
      : records_(records), width_(width), height_(height), normals_(normals), coloured_(coloured) {}
  [[nodiscard]] std::size_t record_bytes() const;
  [[nodiscard]] std::size_t pixels() const;
  [[nodiscard]] std::string_view record(std::size_t pixel) const;
  [[nodiscard]] Eigen::Vector3f in_rig(std::string_view record) const;
  [[nodiscard]] Rgb colour_of(std::string_view record) const;

  std::string_view records_;
  int width_, height_;
  bool normals_, coloured_;
  std::optional<RigidTransform> base_from_rig_;
};

}  // namespace slsd
