// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "core/decode/grid/cell_rays.hpp"
#include "core/decode/grid/sightings.hpp"
#include "core/executor.hpp"
#include "core/geometry/epipolar_gate.hpp"
#include "core/geometry/ray_table.hpp"

namespace slsd {

/// What the calibration knows of the sightings of a frame: the ray on which each lies, and the part of the projector's
/// epipolar line that the working depth leaves.
/// @thread thread-bound: keeps its buffers
class EpipolarView {
 public:
  /// @param tolerance_px  distance from the epipolar line, projector px: epipolar_gate_px()
  EpipolarView(const CalibratedCamera& camera, const Lens& projector, double depth_min_mm, double depth_max_mm,
               double tolerance_px)
      : camera_rays_(camera.lens),
        focal_px_(std::sqrt(camera.lens.fx * camera.lens.fy)),
        gate_(camera, projector, depth_min_mm, depth_max_mm),
        tolerance_px_(tolerance_px) {}

  void look_at(const Sightings& seen, Executor& executor) {
    rays_.resize(seen.size());
    pixels_.resize(seen.size());
    segments_.resize(seen.size());
    executor.run_ranges(seen.size(), [&](std::size_t first, std::size_t last, int) {
      for (std::size_t i = first; i < last; ++i) look_again_at(static_cast<std::int32_t>(i), seen);
    });
  }
  /// At one that was found to lie elsewhere.
  void look_again_at(std::int32_t sighting, const Sightings& seen) {
    const GreyMoments& moments = seen.moments[sighting];
    pixels_[sighting] = {moments.x, moments.y};
    rays_[sighting] = camera_rays_.ray(pixels_[sighting].cast<double>());
    segments_[sighting] = gate_.prepare(rays_[sighting].direction);
  }
  /// One to a sighting.
  [[nodiscard]] std::span<const EpipolarSegment> segments() const { return segments_; }
  [[nodiscard]] double tolerance_px() const { return tolerance_px_; }
  /// The ray of a pixel that lies some tenths beside a sighting's: so far it turns evenly.
  [[nodiscard]] PixelRay ray_near(std::int32_t sighting, const Eigen::Vector2f& camera_px) const {
    PixelRay ray = rays_[sighting];
    ray.direction += ray.turn * (camera_px - pixels_[sighting]).cast<double>();
    return ray;
  }
  /// How far a cell lies off the epipolar line of a pixel near a sighting's, projector px, signed.
  [[nodiscard]] double residual_px(std::int32_t sighting, const Eigen::Vector2f& camera_px,
                                   const PixelRay& cell) const {
    const bool moved = camera_px != pixels_[sighting];
    return moved ? gate_.residual_px(ray_near(sighting, camera_px).direction, cell.direction)
                 : segments_[sighting].residual_px(cell.direction);
  }

  /// Disparity of a cell that is seen at a pixel near a sighting's, camera px.
  [[nodiscard]] double disparity_px(std::int32_t sighting, const Eigen::Vector2f& camera_px,
                                    const PixelRay& cell) const {
    return focal_px_ * gate_.disparity(ray_near(sighting, camera_px).direction, cell.direction);
  }

 private:
  RayTable camera_rays_;
  double focal_px_;
  EpipolarGate gate_;
  double tolerance_px_;
  std::vector<PixelRay> rays_;
  std::vector<Eigen::Vector2f> pixels_;
  std::vector<EpipolarSegment> segments_;
};

}  // namespace slsd
