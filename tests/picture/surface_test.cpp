// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/cloud/surface.hpp"

#include <gtest/gtest.h>

#include "tests/picture/lattice_cloud.hpp"

namespace slsd {
namespace {

TEST(JoinSurface, JoinsAPlaneWhole) {
  const Surface surface = join_surface(lattice_cloud(6, 5, [](int, int) { return 1000; }));
  EXPECT_EQ(surface.triangles.size(), 2U * 5 * 4);
  for (const Eigen::Vector3d& normal : surface.normals) EXPECT_LT((normal - Eigen::Vector3d(0, 0, -1)).norm(), 1e-6);
}

TEST(JoinSurface, LosesFourTrianglesToAMissingPoint) {
  const auto hole = [](int column, int row) { return column == 3 && row == 2 ? 0 : 1000; };
  EXPECT_EQ(join_surface(lattice_cloud(6, 5, hole)).triangles.size(), 2U * 5 * 4 - 4);
}

TEST(JoinSurface, DoesNotBridgeAStep) {
  const Surface surface = join_surface(lattice_cloud(6, 5, [](int column, int) { return column < 3 ? 1000 : 1100; }));
  EXPECT_EQ(surface.triangles.size(), 2U * 2 * (2 * 4));
  for (const auto& triangle : surface.triangles) {
    const double z = surface.points[triangle[0]].z();
    EXPECT_EQ(surface.points[triangle[1]].z(), z);
    EXPECT_EQ(surface.points[triangle[2]].z(), z);
  }
}

TEST(JoinSurface, KeepsCamerasApart) {
  Cloud cloud = lattice_cloud(2, 2, [](int, int) { return 1000; });
  cloud.cameras = 2;
  cloud.points[3].camera = 1;
  EXPECT_EQ(join_surface(cloud).triangles.size(), 1U);
}

TEST(JoinSurface, LeavesALonePointWithoutANormal) {
  const Surface surface = join_surface(lattice_cloud(5, 5, [](int column, int row) { return column + row == 0; }));
  EXPECT_EQ(surface.points.size(), 1U);
  EXPECT_TRUE(surface.triangles.empty());
  EXPECT_EQ(surface.normals[0].norm(), 0);
}

// A file can say so: of a table of the whole lattice that would be terabytes.
TEST(JoinSurface, NeedsNoMoreMemoryForPointsFarApart) {
  Cloud cloud = lattice_cloud(2, 2, [](int, int) { return 1000; });
  CloudPoint far = cloud.points.front();
  far.row = far.column = 65535, far.camera = 255;
  cloud.points.push_back(far);
  far.row = 0;
  cloud.points.push_back(far);
  EXPECT_EQ(join_surface(cloud).triangles.size(), 2U);
}

}  // namespace
}  // namespace slsd
