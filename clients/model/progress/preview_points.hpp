// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <unordered_map>

#include <Eigen/Core>

#include "clients/model/places/shot.hpp"
#include "core/geometry/calibration.hpp"
#include "core/mesh/mesh.hpp"

namespace slsd::model {

/// A light picture of a model for a viewer: one point with its normal for each cube of space that has surface. The
/// cubes grow, so that there are never too many points.
/// @thread thread-bound
class PreviewPoints {
 public:
  /// @param most  points, 1 or more
  explicit PreviewPoints(std::size_t most) : most_(most) {}

  /// Adds the surface that a cloud shows.
  void add(const Shot& shot, const RigidTransform& object_from_rig);
  /// Adds a mesh, with its sigmas.
  void add(const Mesh& mesh);

  /// @return a PLY as docs/model.md describes it; the points have `sigma_mm` if they come from a mesh, and colours if
  ///         the clouds had them
  [[nodiscard]] std::string to_ply() const;

 private:
  /// Sums over a cube of what was added.
  struct Cube {
    Eigen::Vector3f place_mm = Eigen::Vector3f::Zero(), normal = Eigen::Vector3f::Zero();
    float added = 0;                     ///< how many places
    float sigma_mm = 0, with_sigma = 0;  ///< the latter: how many places
    Eigen::Vector3f colour = Eigen::Vector3f::Zero();
    float with_colour = 0;                 ///< how many places
    std::uint32_t frames = 0, latest = 0;  ///< clouds that show it; the number of the latest, from 1 on
  };
  using Key = std::uint64_t;

  [[nodiscard]] Key key_of(const Eigen::Vector3f& place_mm) const;
  Cube& add(const Eigen::Vector3f& place_mm, const Eigen::Vector3f& normal);
  void add_colour(Cube& cube, const Rgb& colour);
  void enlarge();

  std::size_t most_;
  float edge_mm_ = 0;  ///< of a cube; 0: nothing was added
  std::uint32_t shots_ = 0;
  bool has_sigma_ = false, has_colour_ = false;
  std::unordered_map<Key, Cube> cubes_;
};

}  // namespace slsd::model
