// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/progress/preview_points.hpp"

#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "bumpy_ball.hpp"

namespace slsd::model {
namespace {

struct PreviewedPoint {
  Eigen::Vector3f place_mm, normal;
  int frames = 0;
};

std::vector<PreviewedPoint> points_of(const std::string& ply, std::size_t floats = 6) {
  const std::size_t begin = ply.find("end_header\n") + 11, record = 4 * floats + 1;
  std::vector<PreviewedPoint> points;
  for (std::size_t at = begin; at + record <= ply.size(); at += record) {
    PreviewedPoint point;
    std::memcpy(point.place_mm.data(), &ply[at], 12);
    std::memcpy(point.normal.data(), &ply[at + 12], 12);
    point.frames = static_cast<unsigned char>(ply[at + record - 1]);
    points.push_back(point);
  }
  return points;
}

RigidTransform place_at(double degrees) {
  return rig_from_object(0).after(rig_from_object(degrees).inverse());
}

TEST(PreviewPoints, LieOnTheSurfaceAndCountClouds) {
  PreviewPoints preview(60'000);
  for (const double degrees : {0, 20})
    preview.add(shot_of(smooth_ball, rig_from_object(degrees), 0.05F, 1), place_at(degrees));
  const auto points = points_of(preview.to_ply());
  ASSERT_GT(points.size(), 1000);
  std::vector<int> clouds(3);
  for (const PreviewedPoint& point : points) {
    const Eigen::Vector3f at = point.place_mm - kMiddle.cast<float>();
    EXPECT_NEAR(at.norm(), 50, 0.3);
    EXPECT_GT(point.normal.dot(at.normalized()), 0.97F);
    ASSERT_THAT(point.frames, testing::AllOf(testing::Ge(1), testing::Le(2)));
    ++clouds[static_cast<std::size_t>(point.frames)];
  }
  EXPECT_GT(clouds[1], 100);  // what one alone saw, at both rims
  EXPECT_GT(clouds[2], 500);
}

TEST(PreviewPoints, AreNeverTooMany) {
  PreviewPoints preview(300);
  for (const double degrees : {0, 20})
    preview.add(shot_of(bumpy_ball, rig_from_object(degrees), 0.05F, 1), place_at(degrees));
  const auto points = points_of(preview.to_ply());
  EXPECT_LE(points.size(), 300);
  EXPECT_GT(points.size(), 40);
  for (const PreviewedPoint& point : points) EXPECT_NEAR(point.normal.norm(), 1, 1e-5);
}

TEST(PreviewPoints, OfAMeshHaveItsSigmasAndFrames) {
  constexpr float kInvented = std::numeric_limits<float>::quiet_NaN();
  Mesh mesh;
  mesh.vertices_mm = {{0, 0, 0}, {0, 10, 0}, {10, 0, 0}, {100, 0, 0}};
  mesh.triangles = {{0, 1, 2}, {1, 3, 2}};
  mesh.sigma_mm = {0.1F, 0.2F, 0.3F, kInvented};
  mesh.frames = {2, 300, 4, 0};
  PreviewPoints preview(100);
  preview.add(mesh);
  const std::string ply = preview.to_ply();
  const auto points = points_of(ply, 7);
  ASSERT_EQ(points.size(), 4);
  EXPECT_THAT(ply, testing::HasSubstr("property float sigma_mm\nproperty uchar frames\n"));
  for (const PreviewedPoint& point : points) {
    EXPECT_NEAR(point.normal.z(), -1, 1e-6);
    if (point.place_mm.x() == 100) {
      EXPECT_EQ(point.frames, 0);
    } else if (point.place_mm.y() == 10) {
      EXPECT_EQ(point.frames, 255);
    }
  }
}

TEST(PreviewPoints, HaveTheColoursOfTheClouds) {
  auto images = *range_images(measure(smooth_ball, rig_from_object(0), 0.05F, 1), test_calibration(), std::nullopt);
  for (RangeImage& image : images) image.colours.assign(image.depth_mm.size(), Rgb{200, 100, 50});
  PreviewPoints preview(60'000), few(300);
  for (PreviewPoints* const each : {&preview, &few}) {
    each->add(make_shot(images), place_at(0));
    const std::string ply = each->to_ply();
    EXPECT_THAT(ply, testing::HasSubstr("frames\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_"));
    EXPECT_EQ(ply.substr(ply.size() - 3), "\xC8\x64\x32");
  }
}

TEST(PreviewPoints, OfAMeshHaveItsColours) {
  Mesh mesh;
  mesh.vertices_mm = {{0, 0, 0}, {0, 10, 0}, {10, 0, 0}};
  mesh.triangles = {{0, 1, 2}};
  mesh.colours = {{1, 2, 3}, {1, 2, 3}, {1, 2, 3}};
  PreviewPoints preview(100);
  preview.add(mesh);
  const std::string ply = preview.to_ply();
  EXPECT_THAT(ply, testing::HasSubstr("property uchar blue\n"));
  EXPECT_EQ(ply.substr(ply.size() - 3), "\x01\x02\x03");
}

TEST(PreviewPoints, OfNothingAreNone) {
  PreviewPoints preview(10);
  preview.add(Mesh{});
  preview.add(Shot{}, {});
  EXPECT_TRUE(points_of(preview.to_ply()).empty());
}

}  // namespace
}  // namespace slsd::model
