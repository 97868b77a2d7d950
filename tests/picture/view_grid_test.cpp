// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/view_grid.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include "tests/core/geometry/paper_rig.hpp"

namespace slsd {
namespace {

TEST(OutlineOfView, GoesAroundTheBorderOfTheCamerasImage) {
  const Calibration rig = paper_rig();
  const CalibratedCamera& camera = rig.cameras[0];
  const auto outline = outline_of_view(rig, camera, 1500);
  ASSERT_GT(outline.size(), 100U);
  EXPECT_LT((outline.front() - outline.back()).norm(), 1e-9);
  const RigidTransform camera_from_projector = camera.projector_from_camera.inverse();
  for (const Eigen::Vector2d& pixel : outline) {  // back along the projector's ray to the plane at that depth
    const Eigen::Vector3d direction = camera_from_projector.rotation * rig.projector.undistort(pixel).homogeneous();
    const Eigen::Vector3d centre = camera_from_projector.translation;
    const Eigen::Vector2d seen = camera.lens.project(centre + (1500 - centre.z()) / direction.z() * direction);
    const double to_border =
        std::min({std::abs(seen.x()), std::abs(seen.y()), std::abs(seen.x() - (camera.lens.width_px - 1)),
                  std::abs(seen.y() - (camera.lens.height_px - 1))});
    EXPECT_LT(to_border, 1e-3);
  }
}

TEST(OutlineOfView, LeavesOutWhatTheProjectorCannotLight) {
  Calibration rig = paper_rig();
  rig.cameras[0].projector_from_camera.translation.z() = -1600;
  EXPECT_TRUE(outline_of_view(rig, rig.cameras[0], 1500).empty());
}

TEST(DrawViewGrid, ShowsAnOutlineToEachDepth) {
  const Calibration rig = paper_rig();
  const Grey8 grid = draw_view_grid(rig, 1000, 3000);
  ASSERT_EQ(std::pair(grid.width(), grid.height()), std::pair(rig.projector.width_px, rig.projector.height_px));
  int seen = 0;
  for (const double depth_mm : {1000.0, 2000.0, 3000.0}) {
    for (const Eigen::Vector2d& place : outline_of_view(rig, rig.cameras[0], depth_mm)) {
      const int x = static_cast<int>(std::lround(place.x())), y = static_cast<int>(std::lround(place.y()));
      if (!grid.view().contains(x, y)) continue;
      ++seen;
      EXPECT_GT(grid.at(x, y), 60) << depth_mm << " mm at " << x << " " << y;
    }
  }
  EXPECT_GT(seen, 50);
  EXPECT_NE(grid, draw_view_grid(rig, 1000, 4000));
}

}  // namespace
}  // namespace slsd
