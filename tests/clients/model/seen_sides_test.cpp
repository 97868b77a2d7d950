// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

#include "clients/model/places/seen_sides.hpp"

#include <cmath>
#include <numbers>
#include <vector>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

namespace slsd::model {
namespace {

const Eigen::Vector3d kObjectMiddle{20, -30, 800};

/// The object's place when it is turned by these angles about an axis through its middle.
std::vector<RigidTransform> turned(const std::vector<double>& degrees, const Eigen::Vector3d& axis) {
  std::vector<RigidTransform> places;
  for (const double each : degrees) {
    RigidTransform place;
    place.rotation = Eigen::AngleAxisd(each * std::numbers::pi / 180, axis.normalized()).toRotationMatrix();
    place.translation = kObjectMiddle - place.rotation * kObjectMiddle;
    places.push_back(place);
  }
  return places;
}

TEST(SeenSides, GrowWithTheTurn) {
  for (const Eigen::Vector3d& axis : {Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0.2, -1, 0.1)}) {
    const SeenSides sides = seen_sides(turned({0, 10, 20, 30, 40, 50}, axis), kObjectMiddle);
    EXPECT_NEAR(sides.seen_degrees, 50, 4);  // a tilted axis shows a smaller circle
    EXPECT_NEAR(sides.gap_begins_degrees, 50, 4);
    EXPECT_FALSE(sides.all());
    ASSERT_EQ(sides.views_degrees.size(), 6);
    for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(sides.views_degrees[i], 10.0 * static_cast<double>(i), 4);
  }
}

TEST(SeenSides, AreAllOnceNoGapIsLeft) {
  std::vector<double> degrees;
  for (double each = 0; each <= 325; each += 25) degrees.push_back(each);
  EXPECT_FALSE(seen_sides(turned(degrees, {0, 1, 0}), kObjectMiddle).all());
  degrees.push_back(335);
  const SeenSides sides = seen_sides(turned(degrees, {0, 1, 0}), kObjectMiddle);
  EXPECT_TRUE(sides.all());
  EXPECT_EQ(to_string(sides), "seen from all sides");
}

TEST(SeenSides, CountTurnsBackOnce) {
  const SeenSides sides = seen_sides(turned({0, 20, 40, 20, 0, 20, 40, 60}, {0, 1, 0}), kObjectMiddle);
  EXPECT_NEAR(sides.seen_degrees, 60, 1e-6);
}

TEST(SeenSides, NameAGapInTheMiddle) {
  // Tracking was lost from 90 to 200 degrees.
  const SeenSides sides = seen_sides(turned({0, 30, 60, 90, 200, 230, 260, 290, 320, 350}, {0, 1, 0}), kObjectMiddle);
  EXPECT_EQ(to_string(sides), "seen 250 of 360 degrees; missing: 90 to 200 degrees after the first view");
}

TEST(SeenSides, AreUnknownBeforeTheObjectTurns) {
  EXPECT_EQ(seen_sides({}, kObjectMiddle).seen_degrees, 0);
  const SeenSides sides = seen_sides(turned({0, 0.1, 0.2}, {0, 1, 0}), kObjectMiddle);
  EXPECT_EQ(sides.seen_degrees, 0);
  EXPECT_EQ(to_string(sides), "seen from one side: turn the object");
}

}  // namespace
}  // namespace slsd::model
