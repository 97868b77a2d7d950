// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/measured_box.hpp"

#include <gtest/gtest.h>

#include <random>

#include <Eigen/Geometry>

namespace slsd {
namespace {

CalibratedCamera camera(double k1 = -0.1) {
  CalibratedCamera made;
  made.lens = {1600, 1200, 2000, 2010, 790, 610, {k1, 0.02, 1e-3, -5e-4, 0}};
  return made;
}

bool covers(const PixelRectangle& pixels, const Eigen::Vector2d& px) {
  return px.x() >= pixels.left - 0.5 && px.x() <= pixels.right - 0.5 && px.y() >= pixels.top - 0.5 &&
         px.y() <= pixels.bottom - 0.5;
}

TEST(PixelsOfBox, AreWhereTheBoxIsSeen) {
  const auto pixels = pixels_of_box({{-100, -50, 1000}, {100, 50, 1000}}, camera(0), 400, 2500);
  ASSERT_TRUE(pixels);
  const Lens lens = camera(0).lens;
  EXPECT_NEAR(pixels->left, lens.project({-100, -50, 1000}).x(), 2);
  EXPECT_NEAR(pixels->bottom, lens.project({100, 50, 1000}).y(), 2);
}

// Every point of the box that the camera sees lies in the rectangle, and on each side some point lies near its border.
TEST(PixelsOfBox, CoverEveryPointThatIsSeen) {
  std::mt19937 numbers(5);
  std::uniform_real_distribution<double> place(-900, 900), size(10, 900), depth(-200, 2600), share(0, 1),
      turn(-0.5, 0.5);
  int seen = 0, boxes = 0;
  for (int i = 0; i < 300; ++i) {
    CalibratedCamera from = camera();
    from.rig_from_camera.rotation = (Eigen::AngleAxisd(turn(numbers), Eigen::Vector3d::UnitX()) *
                                     Eigen::AngleAxisd(turn(numbers), Eigen::Vector3d::UnitY()))
                                        .toRotationMatrix();
    from.rig_from_camera.translation = {place(numbers), place(numbers), 0};
    const Eigen::Vector3d least(place(numbers), place(numbers), depth(numbers));
    MeasuredBox box{least, least + Eigen::Vector3d(size(numbers), size(numbers), size(numbers))};
    if (i % 2 == 1)
      box.frame_from_rig = {Eigen::AngleAxisd(turn(numbers), Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix(),
                            {place(numbers) / 10, 20, -30}};
    const RigidTransform rig_from_frame = box.frame_from_rig.inverse();
    const auto pixels = pixels_of_box(box, from, 400, 2500);
    boxes += pixels.has_value();
    for (int k = 0; k < 200; ++k) {
      const Eigen::Vector3d of_size = box.most - box.least;
      const Eigen::Vector3d inside(share(numbers) * of_size.x(), share(numbers) * of_size.y(),
                                   share(numbers) * of_size.z());
      const Eigen::Vector3d point = rig_from_frame * (box.least + inside);
      ASSERT_TRUE(box.contains(point));
      const Eigen::Vector3d here = from.rig_from_camera.inverse() * point;
      if (here.z() < 400 || here.z() > 2500) continue;
      const Eigen::Vector2d direction = here.head<2>() / here.z();
      if (std::abs(direction.x()) > 0.38 || std::abs(direction.y()) > 0.28) continue;  // well within the frame
      ++seen;
      ASSERT_TRUE(pixels) << i;
      ASSERT_TRUE(covers(*pixels, from.lens.distort(direction))) << i;
    }
  }
  EXPECT_GT(seen, 3000);
  EXPECT_LT(boxes, 290);  // others lie outside the view
}

TEST(PixelsOfBox, AreNoneOutsideTheView) {
  for (const MeasuredBox& box :
       {MeasuredBox{{2000, 0, 1000}, {2100, 50, 1100}}, MeasuredBox{{-50, -50, -900}, {50, 50, -500}},
        MeasuredBox{{-50, -50, 100}, {50, 50, 390}}, MeasuredBox{{-50, -50, 2510}, {50, 50, 3000}}})
    EXPECT_FALSE(pixels_of_box(box, camera(), 400, 2500));
}

TEST(PixelsOfBox, AreAllAroundTheCamera) {
  const auto pixels = pixels_of_box({{-5000, -5000, -5000}, {5000, 5000, 5000}}, camera(), 400, 2500);
  ASSERT_TRUE(pixels);
  EXPECT_EQ(pixels->left, 0);
  EXPECT_EQ(pixels->top, 0);
  EXPECT_EQ(pixels->right, 1600);
  EXPECT_EQ(pixels->bottom, 1200);
}

}  // namespace
}  // namespace slsd
