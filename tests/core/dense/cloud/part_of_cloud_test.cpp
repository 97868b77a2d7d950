// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/cloud/part_of_cloud.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace slsd {
namespace {

CloudPoint point(float x, float y, float z, float sigma_mm) {
  CloudPoint made;
  made.x = x, made.y = y, made.z = z, made.sigma_mm = sigma_mm;
  return made;
}

/// A view whose every pixel is measured at the same depth.
DenseView flat_view(int width, int height, float depth_mm) {
  DenseView view;
  view.map.reset(width, height);
  for (std::size_t i = 0; i < view.map.pixels.size(); ++i)
    view.map.depth_mm[i] = depth_mm, view.map.sigma_mm[i] = 0.1F, view.map.pixels[i] = DensePixel::kMeasured;
  view.map.count_pixels();
  view.rays = std::make_shared<const RayGrid>(Lens{width, height, 100, 100, 0, 0, {}});
  return view;
}

TEST(KeepPart, KeepsThePointsOfTheBox) {
  std::vector<CloudPoint> points{point(0, 0, 500, 1), point(10, 0, 500, 1), point(0, 0, 490, 1), point(0, -1, 500, 1)};
  keep_part(points, {.box = MeasuredBox{{-5, 0, 495}, {5, 5, 505}}});
  EXPECT_EQ(points, (std::vector<CloudPoint>{point(0, 0, 500, 1)}));
}

TEST(KeepPart, KeepsThePointsBeforeThePlane) {
  std::vector<CloudPoint> points{point(0, 0, 500, 1), point(10, 0, 499, 1), point(0, 0, 501, 1)};
  keep_part(points, {.side = HalfSpace{-Eigen::Vector3d::UnitZ(), -500}});
  EXPECT_EQ(points, (std::vector<CloudPoint>{point(10, 0, 499, 1)}));
}

TEST(KeepPart, KeepsTheMostCertainPointOfEachCube) {
  std::vector<CloudPoint> points{point(1, 1, 501, 0.3F), point(2, 2, 502, 0.1F), point(3, 3, 503, 0.1F),
                                 point(-1, 1, 501, 0.5F), point(11, 1, 501, 0.2F)};
  keep_part(points, {.voxel_mm = 10});
  EXPECT_EQ(points,
            (std::vector<CloudPoint>{point(2, 2, 502, 0.1F), point(-1, 1, 501, 0.5F), point(11, 1, 501, 0.2F)}));
}

TEST(KeepPart, KeepsAllPointsIfTheCubesAreTiny) {
  const std::vector<CloudPoint> all{point(1, 1, 501, 0.3F), point(2, 2, 502, 0.1F), point(-3, 3, 503, 0.2F)};
  for (const double side_mm : {1e-3, 1e-17, 1e-300, std::numeric_limits<double>::denorm_min()}) {
    std::vector<CloudPoint> points = all;
    keep_part(points, {.voxel_mm = side_mm});
    EXPECT_EQ(points, all) << side_mm;
    std::vector<DenseView> views{flat_view(10, 7, 1000)};
    keep_part(views, {.voxel_mm = side_mm});
    EXPECT_EQ(views[0].map.count(DensePixel::kMeasured), 70U) << side_mm;
  }
}

TEST(KeepPart, KeepsEveryNthPixel) {
  std::vector<DenseView> views{flat_view(10, 7, 1000)};
  keep_part(views, {.stride = 3});
  EXPECT_EQ(views[0].map.count(DensePixel::kMeasured), 4U * 3U);
  EXPECT_EQ(views[0].map.count(DensePixel::kThinned), 70U - 12U);
  EXPECT_TRUE(views[0].map.measured(3 * 10 + 9));
}

// At 1000 mm, pixels are 10 mm apart.
TEST(KeepPart, KeepsThePixelsOfTheBox) {
  std::vector<DenseView> views{flat_view(10, 7, 1000)};
  keep_part(views, {.box = MeasuredBox{{15, -5, 900}, {45, 25, 1100}}});
  EXPECT_EQ(views[0].map.count(DensePixel::kMeasured), 3U * 3U);
  EXPECT_EQ(views[0].map.count(DensePixel::kOutsideBox), 70U - 9U);
}

TEST(KeepPart, KeepsThePixelsBeforeThePlane) {
  std::vector<DenseView> views{flat_view(10, 7, 1000)};
  keep_part(views, {.side = HalfSpace{Eigen::Vector3d::UnitX(), 55}});
  EXPECT_EQ(views[0].map.count(DensePixel::kMeasured), 4U * 7U);
  EXPECT_EQ(views[0].map.count(DensePixel::kBehindPlane), 6U * 7U);
}

TEST(KeepPart, SharesCubesBetweenCameras) {
  std::vector<DenseView> views{flat_view(8, 8, 1000), flat_view(8, 8, 1000)};
  views[1].map.sigma_mm.assign(64, 0.05F);
  keep_part(views, {.voxel_mm = 5});
  EXPECT_EQ(views[0].map.count(DensePixel::kMeasured), 0U);
  EXPECT_EQ(views[0].map.count(DensePixel::kThinned), 64U);
  EXPECT_EQ(views[1].map.count(DensePixel::kMeasured), 64U);
}

}  // namespace
}  // namespace slsd
