// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/solve/place_scanners.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include <Eigen/Geometry>

namespace slsd {
namespace {

using ::testing::HasSubstr;

const Board kBoard = *parse_board("charuco:11x7:40:30:DICT_5X5_1000");
const Lens kLens{1600, 1200, 3555, 3555, 799.5, 599.5, {}};

RigidTransform moved(double x_mm, double y_mm, double z_mm, double turn_deg, const Eigen::Vector3d& axis) {
  return {Eigen::AngleAxisd(turn_deg * std::numbers::pi / 180, axis.normalized()).toRotationMatrix(),
          {x_mm, y_mm, z_mm}};
}

/// What a cloud and a picture show of a board, with errors: noise of points and corners, and a plane that is off.
struct Errors {
  double point_mm = 0.2, corner_px = 0.03, bend_mm = 0;
};

Result<CloudView> looked(const RigidTransform& scanner_from_board, std::size_t scanner, std::mt19937& random,
                         const Errors& errors = {}) {
  std::normal_distribution<double> noise;
  BoardSighting sighting;
  for (int id = 0; id < kBoard.point_count(); ++id) {
    const Eigen::Vector2d pixel = kLens.project(scanner_from_board * kBoard.point(id));
    sighting.points.push_back({id, pixel + errors.corner_px * Eigen::Vector2d(noise(random), noise(random))});
  }
  std::vector<Eigen::Vector3d> cloud;
  for (double x = -60; x < kBoard.width_mm() + 60; x += 6) {
    for (double y = -60; y < kBoard.height_mm() + 60; y += 6) {
      const double bend = errors.bend_mm * std::pow(x / kBoard.width_mm() - 0.5, 2);
      cloud.push_back(scanner_from_board * Eigen::Vector3d(x, y, bend));
      cloud.back() *= 1 + errors.point_mm * noise(random) / cloud.back().z();
    }
  }
  auto view = view_in_cloud(cloud, sighting, kBoard, kLens);
  if (view) view->scanner = scanner;
  return view;
}

std::vector<RigidTransform> three_places() {
  return {moved(-200, -140, 2000, 0, {0, 0, 1}), moved(-150, -100, 1900, 20, {1, 0.3, 0.2}),
          moved(-240, -160, 2100, -25, {0.2, 1, 0})};
}

double off_mm(const RigidTransform& found, const RigidTransform& truth, const Eigen::Vector3d& in_first) {
  const Eigen::Vector3d point = truth.inverse() * in_first;
  return (found * point - in_first).norm();
}

TEST(ViewInCloud, TellsWhereTheCornersAreByTheCloudWhateverThePrintsScale) {
  std::mt19937 random(2);
  const RigidTransform at = three_places()[1];
  const auto view = looked(at, 0, random);
  ASSERT_TRUE(view) << to_string(view.error());
  ASSERT_EQ(view->corners.size(), 60U);
  for (const auto& [id, point] : view->corners) EXPECT_LT((point - at * kBoard.point(id)).norm(), 0.15);
  EXPECT_NEAR(view->scale_percent, 0, 0.02);
  EXPECT_LT(view->bend_mm, 0.1);
}

TEST(ViewInCloud, RefusesABoardThatIsNotFlat) {
  std::mt19937 random(2);
  const auto bent = looked(three_places()[0], 0, random, {.bend_mm = 20});
  ASSERT_FALSE(bent);
  EXPECT_EQ(bent.error().code, ErrorCode::kMismatch);
  EXPECT_THAT(bent.error().message, HasSubstr("not flat"));
}

TEST(ViewInCloud, RefusesACloudBesideTheBoard) {
  BoardSighting sighting;
  for (int id = 0; id < kBoard.point_count(); ++id)
    sighting.points.push_back({id, kLens.project(three_places()[0] * kBoard.point(id))});
  const std::vector<Eigen::Vector3d> beside(1000, {900, 0, 2000});
  const auto view = view_in_cloud(beside, sighting, kBoard, kLens);
  ASSERT_FALSE(view);
  EXPECT_EQ(view.error().code, ErrorCode::kNotFound);
  EXPECT_FALSE(view_in_cloud({}, sighting, kBoard, kLens));
}

// The second and the third never see the same place: the third is reached through the first.
TEST(PlaceScanners, FindsThemWithErrorsOfTheSizeThatItSays) {
  const std::vector<RigidTransform> first_from{RigidTransform(), moved(640, -60, 110, -17, {0.1, 1, 0.05}),
                                               moved(-500, 30, 60, 14, {0, 1, 0.1})};
  double middle = 0, far = 0;
  constexpr int kTrials = 40;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::mt19937 random(static_cast<unsigned>(trial));
    std::vector<std::vector<CloudView>> places;
    for (std::size_t other : {1U, 2U}) {
      for (const RigidTransform& place : three_places()) {
        const RigidTransform& to = first_from[other];
        const auto one = looked(place, 0, random), two = looked(to.inverse().after(place), other, random);
        ASSERT_TRUE(one && two);
        places.push_back({*one, *two});
      }
    }
    const auto placed = place_scanners(places, {"a", "b", "c"});
    ASSERT_TRUE(placed) << to_string(placed.error());
    EXPECT_EQ(placed->scanners[0].places, 6U);
    for (std::size_t other : {1U, 2U}) {
      const PlacedScanner& one = placed->scanners[other];
      EXPECT_EQ(one.places, 3U);
      const double off = off_mm(one.first_from_scanner, first_from[other], {0, 0, 2000});
      EXPECT_LT(off, 0.1);
      EXPECT_GE(one.sigma_far_mm, one.sigma_mm);
      middle += std::pow(off / one.sigma_mm, 2) / (2 * kTrials);
      const double worst = off_mm(one.first_from_scanner, first_from[other], three_places()[2] * kBoard.point(9));
      far += std::pow(worst / one.sigma_far_mm, 2) / (2 * kTrials);
    }
  }
  EXPECT_GT(std::sqrt(middle), 0.6);
  EXPECT_LT(std::sqrt(middle), 1.5);
  EXPECT_LT(std::sqrt(far), 1.5);
}

TEST(PlaceScanners, TrustsViewsThatDoNotAgreeLess) {
  std::mt19937 random(7);
  const RigidTransform first_from_second = moved(640, -60, 110, -17, {0.1, 1, 0.05});
  std::vector<std::vector<CloudView>> good, bad;
  for (const RigidTransform& place : three_places()) {
    const auto one = looked(place, 0, random);
    auto two = looked(first_from_second.inverse().after(place), 1, random);
    ASSERT_TRUE(one && two);
    good.push_back({*one, *two});
    for (auto& [id, point] : two->corners) point *= 1 + (bad.size() == 1 ? 1.0 : 0.0) / 2000;  // a millimetre off
    bad.push_back({*one, *two});
  }
  const auto placed = place_scanners(good, {"a", "b"}), doubted = place_scanners(bad, {"a", "b"});
  ASSERT_TRUE(placed && doubted);
  EXPECT_GT(doubted->scanners[1].sigma_mm, 5 * placed->scanners[1].sigma_mm);
  EXPECT_GT(doubted->off_mm[1], 5 * placed->off_mm[1]);
}

TEST(PlaceScanners, SaysWhoIsNotReached) {
  std::mt19937 random(7);
  const auto one = looked(three_places()[0], 0, random), two = looked(three_places()[0], 1, random);
  auto third = looked(three_places()[1], 2, random);
  ASSERT_TRUE(one && two && third);
  const auto placed = place_scanners({{*one, *two}, {*third}}, {"a", "b", "c"});
  ASSERT_FALSE(placed);
  EXPECT_EQ(placed.error().where, "c");
  EXPECT_EQ(placed.error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace slsd
