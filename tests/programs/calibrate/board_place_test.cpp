// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/session/guide/board_place.hpp"

#include <numbers>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

namespace slsd {
namespace {

constexpr ImageSize kImage{1000, 800};
constexpr double kDegree = std::numbers::pi / 180;

struct Held {
  Eigen::Vector3d middle_mm{0, 0, 800};
  double tilt_x_deg = 0, tilt_y_deg = 0, turn_deg = 0;
};

const Board& board() {
  static const Board made = *parse_board("chessboard:9x6:25");
  return made;
}

/// By a camera of the focal length that is guessed.
BoardPlace place(const Held& held) {
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(held.tilt_x_deg * kDegree, Eigen::Vector3d::UnitX()) *
                                Eigen::AngleAxisd(held.tilt_y_deg * kDegree, Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(held.turn_deg * kDegree, Eigen::Vector3d::UnitZ()))
                                   .toRotationMatrix();
  const Eigen::Vector3d half(board().width_mm() / 2, board().height_mm() / 2, 0);
  std::vector<Tie> ties;
  for (const Eigen::Vector3d& point : board().points()) {
    const Eigen::Vector3d seen = turn * (point - half) + held.middle_mm;
    ties.push_back({point.head<2>(), Eigen::Vector2d(499.5, 399.5) + 1200 * seen.hnormalized()});
  }
  return *place_of(ties, board(), kImage);
}

TEST(PlaceOf, FindsTiltDistanceAndTurn) {
  const BoardPlace seen = place({{100, -50, 700}, 0, 30, 20});
  EXPECT_NEAR(seen.tilt_deg(), 30, 0.01);
  EXPECT_NEAR(seen.distance_mm, Eigen::Vector3d(100, -50, 700).norm(), 0.01);
  EXPECT_NEAR(seen.centre.x(), (499.5 + 1200 * 100 / 700.0) / 1000, 1e-6);
  EXPECT_NEAR(place({{0, 0, 700}, 0, 0, 20}).turn_rad, 20 * kDegree, 1e-6);
}

TEST(PlaceOf, NeedsFourPoints) {
  EXPECT_FALSE(place_of(std::vector<Tie>(3), board(), kImage));
}

TEST(AreAlike, TellsPosesApart) {
  const BoardPlace first = place({});
  EXPECT_TRUE(are_alike(first, first));
  EXPECT_TRUE(are_alike(first, place({{20, 10, 810}, 2, 2, 5})));
  EXPECT_FALSE(are_alike(first, place({{150, 0, 800}})));
  EXPECT_FALSE(are_alike(first, place({{0, 120, 800}})));
  EXPECT_FALSE(are_alike(first, place({{0, 0, 800}, 15})));
  EXPECT_FALSE(are_alike(first, place({{0, 0, 800}, 0, -15})));
  EXPECT_FALSE(are_alike(first, place({{0, 0, 800}, 0, 0, 90})));
  EXPECT_FALSE(are_alike(first, place({{0, 0, 1000}})));
}

// A turn by almost a full circle is a small one.
TEST(AreAlike, TakesTheShorterWayRound) {
  EXPECT_TRUE(are_alike(place({{0, 0, 800}, 0, 0, 175}), place({{0, 0, 800}, 0, 0, -175})));
}

}  // namespace
}  // namespace slsd
