// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/watch/drift_watch.hpp"

#include <random>

#include <gtest/gtest.h>

#include "tests/core/calibrate/knocked_rig.hpp"
#include "tests/core/calibrate/synthetic_rig.hpp"

namespace slsd {
namespace {

using Change = DriftWatch::Change;

const Eigen::Vector3d kStill = Eigen::Vector3d::Zero();
const Eigen::Vector3d kTilted(0.5, 0, 0);  // about 1.25 px across the epipolar lines
const Eigen::Vector3d kRolled(0, 0, 4);    // 1 px up on one side, 1 px down on the other

/// Scans by a rig that may have been knocked, watched by the calibration from before.
class DriftWatchTest : public ::testing::Test {
 protected:
  std::vector<CloudPoint> scan_points(const Eigen::Vector3d& turn_mrad, int count) {
    const Calibration now = knocked(true_rig(), turn_mrad).calibration({{"camera0", {1600, 1200}}});
    const CalibratedCamera& camera = now.cameras.front();
    std::uniform_real_distribution<double> u(0, 1600), v(0, 1200), depth(1600, 2200);
    std::normal_distribution<double> noise(0, 0.3);
    std::vector<CloudPoint> points;
    for (int i = 0; i < count; ++i) {
      const double x = u(random_), y = v(random_), z = depth(random_), dx = noise(random_), dy = noise(random_);
      const Eigen::Vector3d point = z * camera.lens.undistort({x, y}).homogeneous();
      const Eigen::Vector2d lit = now.projector.project(camera.projector_from_camera * point);
      CloudPoint& one = points.emplace_back();
      one.camera_u = static_cast<float>(x + dx), one.camera_v = static_cast<float>(y + dy);
      one.projector_u = static_cast<float>(lit.x()), one.projector_v = static_cast<float>(lit.y());
    }
    return points;
  }

  /// @return what changed, with the number of its scan
  std::vector<std::pair<Change, std::uint64_t>> scan(int scans, const Eigen::Vector3d& turn_mrad, int count = 600) {
    std::vector<std::pair<Change, std::uint64_t>> changes;
    for (int i = 0; i < scans; ++i) {
      const Change change = watch_.note(scan_points(turn_mrad, count), 0, ++number_);
      if (change != Change::kNone) changes.emplace_back(change, number_);
    }
    return changes;
  }

  const Calibration calibration_ = true_rig().calibration({{"camera0", {1600, 1200}}});
  DriftWatch watch_{calibration_.cameras.front(), calibration_.projector, 0.1};
  std::mt19937 random_{1};
  std::uint64_t number_ = 0;
};

TEST_F(DriftWatchTest, SaysNothingOfARigThatStays) {
  EXPECT_TRUE(scan(100, kStill).empty());
  EXPECT_EQ(watch_.state().scans, 100U);
  EXPECT_LT(watch_.state().epipolar_px, 0.1);
  EXPECT_DOUBLE_EQ(watch_.state().limit_px, 0.3);
  EXPECT_FALSE(watch_.state().off_since_scan);
}

TEST_F(DriftWatchTest, SaysSinceWhichScanAndByHowMuch) {
  ASSERT_TRUE(scan(40, kStill).empty());
  const auto changes = scan(60, kTilted);
  ASSERT_EQ(changes.size(), 1U);
  EXPECT_EQ(changes[0].first, Change::kOff);
  EXPECT_LE(changes[0].second, 60U);
  EXPECT_EQ(watch_.state().off_since_scan, 41U);
  EXPECT_NEAR(watch_.state().epipolar_px, 1.25, 0.2);
}

TEST_F(DriftWatchTest, SeesARollThoughItsMedianIsNothing) {
  ASSERT_TRUE(scan(30, kStill).empty());
  ASSERT_EQ(scan(60, kRolled).size(), 1U);
  EXPECT_EQ(watch_.state().off_since_scan, 31U);
}

// 0.1 degrees about each axis that epipolar lines show, and the smallest knock that is one.
TEST_F(DriftWatchTest, TellsAKnockWithinTenScans) {
  for (const Eigen::Vector3d& turn_mrad : {Eigen::Vector3d(0, 0, 1.745), {1.745, 0, 0}, {0.16, 0, 0}, {17, 0, 0}}) {
    watch_ = DriftWatch(calibration_.cameras.front(), calibration_.projector, 0.1);
    ASSERT_TRUE(scan(30, kStill).empty());
    const std::uint64_t before = number_;
    const auto changes = scan(10, turn_mrad);
    ASSERT_EQ(changes.size(), 1U) << turn_mrad.transpose();
    EXPECT_EQ(changes[0].first, Change::kOff);
    EXPECT_EQ(watch_.state().off_since_scan, before + 1);
  }
}

TEST_F(DriftWatchTest, HasNoFalseAlarmInAThousandScans) {
  EXPECT_TRUE(scan(1000, kStill, 300).empty());
}

// Of an empty scene all that is read is misread.
TEST_F(DriftWatchTest, IsNotMisledByPointsThatLieAnywhere) {
  std::uniform_real_distribution<float> anywhere(-300, 300);
  for (int i = 0; i < 200; ++i) {
    auto points = scan_points(kStill, 60);
    for (CloudPoint& point : points) point.projector_v += anywhere(random_);
    ASSERT_EQ(watch_.note(points, 0, ++number_), Change::kNone) << i;
  }
}

TEST_F(DriftWatchTest, IsFineAgainAsTheRigIs) {
  ASSERT_EQ(scan(60, kTilted).size(), 1U);
  const auto changes = scan(100, kStill);
  ASSERT_EQ(changes.size(), 1U);
  EXPECT_EQ(changes[0].first, Change::kFineAgain);
  EXPECT_FALSE(watch_.state().off_since_scan);
}

TEST_F(DriftWatchTest, LearnsWhatIsUsualWhereTheCalibrationDoesNotSay) {
  watch_ = DriftWatch(calibration_.cameras.front(), calibration_.projector, std::nullopt);
  EXPECT_TRUE(scan(19, kTilted).empty());
  const auto changes = scan(11, kTilted);
  ASSERT_EQ(changes.size(), 1U);  // 1.25 px are more than any rig is taken to be used to
  EXPECT_EQ(watch_.state().limit_px, 1.0);
}

TEST_F(DriftWatchTest, FewPointsSayNothing) {
  EXPECT_TRUE(scan(50, kTilted, 8).empty());
  EXPECT_EQ(watch_.state().scans, 0U);
}

TEST_F(DriftWatchTest, PassesOverTheOtherCameras) {
  for (int i = 0; i < 40; ++i) {
    EXPECT_EQ(watch_.note(scan_points(kTilted, 300), 1, ++number_), Change::kNone);
  }
  EXPECT_EQ(watch_.state().scans, 0U);
}

}  // namespace
}  // namespace slsd
