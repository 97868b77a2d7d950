// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/decode/grid/cell_rays.hpp"
#include "core/decode/grid/sightings.hpp"
#include "core/decode/lattice.hpp"
#include "core/executor.hpp"
#include "core/geometry/epipolar/epipolar_gate.hpp"
#include "core/geometry/ray_table.hpp"

namespace slsd {

/// Epipolar geometry of a frame's sightings: the ray of each, and its segment of the projector's epipolar line within
/// the working depth.
/// @thread thread-bound: keeps its buffers
class EpipolarView {
 public:
  /// @param tolerance_px  distance from the epipolar line, projector px: epipolar_gate_px()
  EpipolarView(const CalibratedCamera& camera, const Lens& projector, double depth_min_mm, double depth_max_mm,
               double tolerance_px)
      : camera_rays_(camera.lens),
        focal_px_(static_cast<float>(std::sqrt(camera.lens.fx * camera.lens.fy))),
        gate_(camera, projector, depth_min_mm, depth_max_mm),
        tolerance_px_(tolerance_px) {}

  void look_at(const Sightings& seen, Executor& executor) {
    rays_.resize(seen.size());
    pixels_.resize(seen.size());
    segments_.resize(seen.size());
    executor.run_ranges(
        seen.size(),
        [&](std::size_t first, std::size_t last, int) {
          PixelRays rays;
          for (std::size_t i = first; i < last; ++i) {
            pixels_[i] = {seen.moments[i].x, seen.moments[i].y};
            rays.u[i - first] = pixels_[i].x(), rays.v[i - first] = pixels_[i].y();
          }
          camera_rays_.look_up(rays, last - first);
          for (std::size_t i = first; i < last; ++i) rays_[i] = rays.at(i - first);
          gate_.prepare(rays, std::span(segments_).subspan(first, last - first));
        },
        PixelRays::kAtOnce);
  }
  /// Updates one sighting whose centre has moved.
  void look_again_at(std::int32_t sighting, const Sightings& seen) {
    const GreyMoments& moments = seen.moments[sighting];
    pixels_[sighting] = {moments.x, moments.y};
    rays_[sighting] = camera_rays_.ray(pixels_[sighting].cast<double>());
    segments_[sighting] = gate_.prepare(rays_[sighting].direction);
  }
  /// One for each sighting.
  [[nodiscard]] std::span<const EpipolarSegment> segments() const { return segments_; }
  [[nodiscard]] double tolerance_px() const { return tolerance_px_; }
  /// The ray of a pixel some tenths of a pixel from a sighting's. Over so short a distance, rays change linearly.
  [[nodiscard]] PixelRay ray_near(std::int32_t sighting, const Eigen::Vector2f& camera_px) const {
    PixelRay ray = rays_[sighting];
    ray.direction += ray.turn * (camera_px - pixels_[sighting]).cast<double>();
    return ray;
  }
  /// Compares symbols whose centres lie near their sightings with their cells.
  /// @param residuals_px    signed distance of each cell from the epipolar line of its centre, projector px
  /// @param disparities_px  camera px
  void compare(std::span<const LatticeSymbol> symbols, const CellRays& cells, std::span<float> residuals_px,
               std::span<float> disparities_px) const {
    RayPairs rays;
    for (std::size_t first = 0; first < symbols.size(); first += PixelRays::kAtOnce) {
      const std::size_t count = std::min(PixelRays::kAtOnce, symbols.size() - first);
      for (std::size_t i = 0; i < count; ++i) {
        const LatticeSymbol& symbol = symbols[first + i];
        const Eigen::Vector2d seen = ray_near(symbol.sighting, symbol.centre_px).direction,
                              lit = cells.ray(symbol.row, symbol.column).direction;
        rays.camera_x[i] = seen.x(), rays.camera_y[i] = seen.y();
        rays.projector_x[i] = lit.x(), rays.projector_y[i] = lit.y();
      }
      gate_.compare(rays, residuals_px.subspan(first, count), disparities_px.subspan(first, count));
    }
    for (float& disparity : disparities_px) disparity *= focal_px_;
  }

 private:
  RayTable camera_rays_;
  float focal_px_;
  EpipolarGate gate_;
  double tolerance_px_;
  std::vector<PixelRay> rays_;
  std::vector<Eigen::Vector2f> pixels_;
  std::vector<EpipolarSegment> segments_;
};

}  // namespace slsd
