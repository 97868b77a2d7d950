// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/cloud/view.hpp"

#include <Eigen/Geometry>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/picture/lattice_cloud.hpp"

namespace slsd {
namespace {

constexpr View::Frame kFrame{40, 30, 400, 300};

RC_GTEST_PROP(View, FitsTheWholeBoxIntoTheFrame, ()) {
  const auto side = [] { return 1.0 + *rc::gen::inRange(0, 1000); };
  const Eigen::Vector3d low(-side(), -side(), side());
  const Box box{low, low + Eigen::Vector3d(side(), side(), side())};
  const View view(box, kFrame);
  Eigen::AlignedBox2d seen;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d share(corner & 1, corner >> 1 & 1, corner >> 2);
    seen.extend(view.flat(box.low + share.cwiseProduct(box.size())));
  }
  RC_ASSERT(seen.min().x() > kFrame.left_px - 1e-6 && seen.max().x() < kFrame.left_px + kFrame.width_px + 1e-6);
  RC_ASSERT(seen.min().y() > kFrame.top_px - 1e-6 && seen.max().y() < kFrame.top_px + kFrame.height_px + 1e-6);
  const Eigen::Vector2d used = seen.sizes();
  RC_ASSERT(used.x() > kFrame.width_px - 1e-6 || used.y() > kFrame.height_px - 1e-6);
}

TEST(View, KeepsRightRightAndDownDown) {
  const View view({{-100, -100, 900}, {100, 100, 1100}}, kFrame);
  const Eigen::Vector3d middle = view.place({0, 0, 1000});
  EXPECT_GT(view.place({50, 0, 1000}).x(), middle.x());
  EXPECT_GT(view.place({0, 50, 1000}).y(), middle.y());
  EXPECT_GT(view.place({0, 0, 1050}).z(), middle.z());
  EXPECT_NEAR((view.place({30, 40, 1000}) - middle).norm(), 50 * view.px_per_mm(), 1e-9);
}

TEST(BoxOf, LeavesOutStrayPoints) {
  Cloud cloud = lattice_cloud(40, 30, [](int, int) { return 1000; });
  cloud.points.push_back({.x = 90000, .y = 0, .z = 1000});
  const Box box = box_of(cloud);
  EXPECT_LT(box.high.x(), 300);
  EXPECT_LT(box.low.x(), cloud.points[0].x);
}

TEST(BoxOf, GivesAPlaneDepthAndAPointRoom) {
  const Box plane = box_of(lattice_cloud(40, 30, [](int, int) { return 1000; }));
  EXPECT_NEAR(plane.size().z(), 0.2 * plane.size().maxCoeff(), 1e-6);
  EXPECT_GE(box_of(lattice_cloud(1, 1, [](int, int) { return 1000; })).size().minCoeff(), 1.0 - 1e-9);
  EXPECT_GT(box_of({}).size().minCoeff(), 0);
}

}  // namespace
}  // namespace slsd
