// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/calibration.hpp"
#include "core/image.hpp"

namespace slsd::adversary {

enum class Outline : std::uint8_t { kRectangle, kEllipse, kHoles };

/// A flat piece. Shapes are in the camera's frame, millimetres.
struct Plate {
  Eigen::Vector3d centre;
  Eigen::Matrix3d axes;  ///< columns: along, across, normal
  Eigen::Vector2d half_mm;
  Outline outline = Outline::kRectangle;
  double hole_radius_mm = 0, hole_pitch_mm = 1;  ///< round holes; every other row of them is half a pitch on
};
struct Ball {
  Eigen::Vector3d centre;
  double radius_mm;
};
/// A straight round wire without its ends.
struct Tube {
  Eigen::Vector3d from, to;
  double radius_mm;
};
using Shape = std::variant<Plate, Ball, Tube>;

/// Shapes at known places: what a camera and a projector see is found by casting rays.
class DepthScene {
 public:
  struct Solid {
    Shape shape;
    std::uint16_t part;
  };

  /// Begins a surface of its own; the shapes added next belong to it.
  void begin_part(double albedo) { albedos_.push_back(static_cast<float>(albedo)); }
  void add(const Shape& shape) { solids_.push_back({shape, static_cast<std::uint16_t>(albedos_.size() - 1)}); }
  /// Adds the five sides of a box that may be seen, each a part.
  /// @param axes  columns; the third points away from the camera
  void add_box(const Eigen::Vector3d& centre, const Eigen::Matrix3d& axes, const Eigen::Vector3d& half_mm,
               double albedo);

  [[nodiscard]] const std::vector<Solid>& solids() const { return solids_; }
  [[nodiscard]] float albedo(std::uint16_t part) const { return albedos_[part]; }

 private:
  std::vector<Solid> solids_;
  std::vector<float> albedos_;
};

/// What each pixel of the camera sees.
struct SceneTruth {
  static constexpr std::uint16_t kNothing = 0xFFFF;

  Image<float> depth_mm;                     ///< along the optical axis; 0: nothing is seen
  Image<std::uint16_t> part;                 ///< kNothing: nothing is seen
  Image<std::array<float, 2>> projector_px;  ///< whose light is there; -1, -1: shadow, or beyond its image
  Image<float> shade;                        ///< projector's light on a matt surface at 1.9 m that faces it: the albedo
  Image<float> albedo;
};

/// Casts a ray through each pixel of the first camera, and from the projector to what it meets.
[[nodiscard]] SceneTruth look_at(const DepthScene& scene, const Calibration& rig);

}  // namespace slsd::adversary
