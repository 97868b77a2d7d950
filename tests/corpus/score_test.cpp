// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/corpus/score.hpp"

#include <gmock/gmock.h>

namespace slsd {
namespace {

/// Two cells of a plane at 1 m; the second is seen in part.
Scene two_cells() {
  Scene scene;
  CalibratedCamera camera;
  camera.lens = {640, 480, 1000, 1000, 320, 240, {}};
  scene.calibration.cameras.push_back(camera);
  scene.truth = {{0, 0, {100, 100}, {120, 120}, SurfaceTruth{{110, 110}, 1000, {0, 0}}, true},
                 {1, 0, {124, 100}, {130, 120}, std::nullopt, false}};
  return scene;
}

CloudPoint point_of(int column, float camera_u, float camera_v, float z_mm) {
  CloudPoint point;
  point.column = static_cast<std::uint16_t>(column);
  point.camera_u = camera_u;
  point.camera_v = camera_v;
  point.x = (camera_u - 320) / 1000 * z_mm;
  point.y = (camera_v - 240) / 1000 * z_mm;
  point.z = z_mm;
  return point;
}

TEST(Score, CountsRightPointsAndTheirDepth) {
  const Score result = score(two_cells(), {point_of(0, 110.3F, 109, 1002), point_of(1, 127, 110, 1300)});
  EXPECT_EQ(result.resolvable, 1);
  EXPECT_EQ(result.decoded, 1);
  EXPECT_THAT(result.wrong, testing::IsEmpty());
  EXPECT_EQ(result.measured, 1);
  EXPECT_NEAR(result.depth_rms_mm, 2, 1e-3);
}

TEST(Score, FindsThePointOfANeighbouringCell) {
  const CloudPoint wrong = point_of(0, 127, 110, 1000);
  EXPECT_THAT(score(two_cells(), {wrong}).wrong, testing::ElementsAre(wrong));
}

TEST(Score, FindsThePointOfACellThatIsNotSeen) {
  EXPECT_EQ(score(two_cells(), {point_of(2, 110, 110, 1000)}).wrong.size(), 1);
}

TEST(Score, FindsTheSecondPointOfACell) {
  EXPECT_EQ(score(two_cells(), {point_of(0, 110, 110, 1000), point_of(0, 111, 110, 1000)}).wrong.size(), 1);
}

TEST(Score, TakesOutliersFromTheInliers) {
  Scene scene = two_cells();
  scene.truth.clear();
  std::vector<CloudPoint> points;
  for (int column = 0; column < 9; ++column) {
    const double u = 100 + 20.0 * column;
    scene.truth.push_back({column, 0, {u - 8, 92}, {u + 8, 108}, SurfaceTruth{{u, 100}, 1000, {0, 0}}, true});
    points.push_back(point_of(column, static_cast<float>(u), 100, column == 4 ? 1003 : 1000));
  }
  const Score result = score(scene, points);
  EXPECT_EQ(result.decoded, 9);
  EXPECT_EQ(result.inliers, 8);
  EXPECT_THAT(result.wrong, testing::IsEmpty());
}

TEST(InlierLimit, GrowsWithTheSpreadAndWithTheDepth) {
  EXPECT_NEAR(inlier_limit_mm(0, 4000), 2, 1e-9);
  EXPECT_NEAR(inlier_limit_mm(1, 2000), 7.413, 1e-9);
}

TEST(SurfaceTruth, FollowsAPlane) {
  // z = 1000 / (1 - 0.1 (u - 320) / 1000) is the plane z - 0.1 x = 1000 before a camera with f = 1000 px.
  const auto depth = [](double u) { return 1000 / (1 - 0.1 * (u - 320) / 1000); };
  const double slope = (depth(400.01) - depth(399.99)) / 0.02;
  const SurfaceTruth surface{{400, 200}, depth(400), {slope, 0}};
  EXPECT_NEAR(surface.depth_mm({403, 210}), depth(403), 1e-5);
}

TEST(ReadTruth, ReadsCellsWithAndWithoutSurface) {
  const auto cells = read_truth(
      "column,row,left,top,right,bottom,camera_u,camera_v,z_mm,dz_du_mm_px,dz_dv_mm_px,resolvable\n"
      "3,4,10,20,30,40,20.5,30.5,2000.125,-0.5,0.25,1\n"
      "5,4,34,20,40,40,,,,,,0\n",
      "truth.csv");
  ASSERT_TRUE(cells) << to_string(cells.error());
  ASSERT_EQ(cells->size(), 2);
  EXPECT_EQ(cells->at(0).surface->z_mm, 2000.125);
  EXPECT_TRUE(cells->at(0).resolvable);
  EXPECT_FALSE(cells->at(1).surface);
  EXPECT_TRUE(cells->at(1).covers({37, 30}));
}

TEST(ReadTruth, NamesTheLineThatIsDamaged) {
  const auto cells =
      read_truth("column,row,left,top,right,bottom,camera_u,camera_v,z_mm,dz_du_mm_px,dz_dv_mm_px,resolvable\n3,4,10\n",
                 "truth.csv");
  ASSERT_FALSE(cells);
  EXPECT_EQ(cells.error().where, "truth.csv:2");
}

}  // namespace
}  // namespace slsd
