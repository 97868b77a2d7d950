// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/pixels/occlusion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

Occlusion occlusion(const Calibration& rig) {
  return {rig.cameras[0], rig.projector, std::make_shared<const RayGrid>(rig.cameras[0].lens)};
}

/// The middle row of the camera: one pixel sees a point at 1.5 m, another one behind it on the same ray of the
/// projector.
TEST(DropOccluded, ARayOfTheProjectorEndsAtItsFirstSurface) {
  const Calibration rig = paper_rig();
  const CalibratedCamera& camera = rig.cameras[0];
  const RigidTransform camera_from_projector = camera.projector_from_camera.inverse();
  const Eigen::Vector3d from = camera_from_projector.translation,
                        ray = camera_from_projector.rotation * rig.projector.undistort({640, 400}).homogeneous();
  DenseMap map;
  map.reset(camera.lens.width_px, camera.lens.height_px);
  std::vector<std::size_t> pixels;
  for (const double distance : {1500.0, 1900.0}) {
    const Eigen::Vector3d point = from + distance * ray;
    const Eigen::Vector2d seen = camera.lens.project(point);
    const std::size_t pixel =
        static_cast<std::size_t>(std::lround(seen.y())) * map.width + static_cast<std::size_t>(std::lround(seen.x()));
    map.depth_mm[pixel] = static_cast<float>(point.z()), map.sigma_mm[pixel] = 1, map.intensity[pixel] = 1;
    map.pixels[pixel] = DensePixel::kMeasured;
    pixels.push_back(pixel);
  }
  SerialExecutor executor;
  occlusion(rig).drop_occluded(map, executor);
  EXPECT_EQ(map.pixels[pixels[0]], DensePixel::kMeasured);
  EXPECT_EQ(map.pixels[pixels[1]], DensePixel::kOccluded);
}

/// Surfaces with jumps, waves and holes, drawn at random.
DenseMap random_map(const Lens& lens, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(0, 1);
  DenseMap map;
  map.reset(lens.width_px, lens.height_px);
  struct Patch {
    double left, top, right, bottom, depth, slope, wave;
  };
  std::vector<Patch> patches{{0, 0, 1, 1, 2000, 300, 3}};
  for (int i = 0; i < 12; ++i) {
    const double x = any(random), y = any(random);
    patches.push_back({x, y, x + 0.3 * any(random), y + 0.3 * any(random), 1500 + 600 * any(random),
                       400 * (any(random) - 0.5), 20 * any(random)});
  }
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      const double u = static_cast<double>(x) / map.width, v = static_cast<double>(y) / map.height;
      double depth = std::numeric_limits<double>::max();
      for (const Patch& patch : patches) {
        if (u < patch.left || v < patch.top || u > patch.right || v > patch.bottom) continue;
        depth = std::min(depth, patch.depth + patch.slope * u + patch.wave * std::sin(0.05 * x) * std::sin(0.04 * y));
      }
      if (any(random) < 0.05) continue;
      const std::size_t pixel = static_cast<std::size_t>(y) * map.width + x;
      map.depth_mm[pixel] = static_cast<float>(depth), map.sigma_mm[pixel] = 1, map.intensity[pixel] = 1;
      map.pixels[pixel] = DensePixel::kMeasured;
    }
  }
  return map;
}

/// The same, pixel by pixel.
std::vector<DensePixel> plain_status(const DenseMap& map, const Calibration& rig) {
  const CalibratedCamera& camera = rig.cameras[0];
  const std::size_t count = map.pixels.size();
  std::vector<std::int64_t> at(count, -1);
  std::vector<double> distance(count),
      nearest(static_cast<std::size_t>(rig.projector.width_px) * rig.projector.height_px,
              std::numeric_limits<double>::max());
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      const std::size_t pixel = static_cast<std::size_t>(y) * map.width + x;
      if (!map.measured(pixel)) continue;
      const Eigen::Vector3d ray = camera.lens.undistort({x, y}).homogeneous();
      const Eigen::Vector3d point =
          camera.projector_from_camera.rotation * ray * map.depth_mm[pixel] + camera.projector_from_camera.translation;
      const Eigen::Vector2d seen = rig.projector.project(point);
      const auto column = std::lround(seen.x()), row = std::lround(seen.y());
      if (column < 0 || row < 0 || column >= rig.projector.width_px || row >= rig.projector.height_px) continue;
      at[pixel] = row * rig.projector.width_px + column, distance[pixel] = point.z();
      nearest[at[pixel]] = std::min(nearest[at[pixel]], point.z());
    }
  }
  std::vector<DensePixel> status = map.pixels;
  for (std::size_t pixel = 0; pixel < count; ++pixel) {
    if (!map.measured(pixel)) continue;
    if (at[pixel] < 0) {
      status[pixel] = DensePixel::kUnlit;
    } else if (distance[pixel] > 1.01 * nearest[at[pixel]]) {
      status[pixel] = DensePixel::kOccluded;
    }
  }
  return status;
}

TEST(DropOccluded, TilesDropWhatSinglePixelsDrop) {
  Calibration rig = paper_rig();
  // The last tiles of a row and a column are narrow.
  rig.cameras[0].lens.width_px = 405, rig.cameras[0].lens.height_px = 299;
  for (double* value :
       {&rig.cameras[0].lens.fx, &rig.cameras[0].lens.fy, &rig.cameras[0].lens.cx, &rig.cameras[0].lens.cy})
    *value /= 4;
  SerialExecutor executor;
  for (std::uint32_t seed = 1; seed <= 6; ++seed) {
    // A projector that looks past a part of the scene.
    rig.projector.cx += 60 * (seed % 3);
    Occlusion checked = occlusion(rig);
    DenseMap map = random_map(rig.cameras[0].lens, seed);
    const std::vector<DensePixel> expected = plain_status(map, rig);
    checked.drop_occluded(map, executor);
    checked.drop_beyond_the_light(map);
    std::size_t occluded = 0, unlit = 0, other = 0;
    for (std::size_t pixel = 0; pixel < expected.size(); ++pixel) {
      occluded += expected[pixel] == DensePixel::kOccluded, unlit += expected[pixel] == DensePixel::kUnlit;
      other += expected[pixel] != map.pixels[pixel];
    }
    EXPECT_GT(occluded, 100U) << seed;
    // Rounding to a projector pixel decides about some.
    EXPECT_LT(other, 0.01 * static_cast<double>(occluded + unlit)) << seed;
  }
}

}  // namespace
}  // namespace slsd
