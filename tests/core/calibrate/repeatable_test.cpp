// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// The same input gives the same calibration, to the last digit and whatever else the machine does; nearly the same
// input gives nearly the same.
#include <algorithm>
#include <chrono>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "core/calibrate/calibrate.hpp"
#include "tests/core/calibrate/outcome.hpp"
#include "tests/core/calibrate/synthetic_rig.hpp"

namespace slsd {
namespace {

using test::expect_near_truth;
using test::left_out;
using test::report_of;

/// A rig that sees one pose in a skewed picture, with every fourth symbol: quick to calibrate.
Observations see_one_skewed(double skew, int poses = 8) {
  Observations observations = see(true_rig(), true_poses(poses));
  for (PoseObservation& pose : observations.poses) {
    std::vector<ProjectedPoint> few;
    for (std::size_t i = 0; i < pose.views[0].symbols.size(); i += 4) few.push_back(pose.views[0].symbols[i]);
    pose.views[0].symbols = few;
  }
  PoseView& view = observations.poses[5].views[0];
  for (BoardPoint& corner : view.corners) corner.camera_px.x() += skew * corner.camera_px.y();
  for (ProjectedPoint& symbol : view.symbols) symbol.camera_px.x() += skew * symbol.camera_px.y();
  return observations;
}

void expect_right_focal_lengths(const CalibrationOutcome& outcome) {
  const RigModel truth = true_rig();
  EXPECT_NEAR(outcome.rig.cameras[0].lens[0] / truth.cameras[0].lens[0], 1, 0.003);
  EXPECT_NEAR(outcome.rig.projector.lens[0] / truth.projector.lens[0], 1, 0.003);
}

std::string every_digit_of(const CalibrationOutcome& outcome) {
  std::string text;
  const auto add = [&text](const auto& values) {
    for (const double value : values) text += fmt::format("{:a} ", value);
    text += '\n';
  };
  for (const DeviceModel& camera : outcome.rig.cameras) add(camera.lens), add(camera.device_from_rig);
  add(outcome.rig.projector.lens), add(outcome.rig.projector.device_from_rig);
  for (const MotionVector& pose : outcome.rig.rig_from_board) add(pose);
  for (const ParameterReport& parameter : outcome.parameters) add(std::vector{parameter.value, parameter.sigma});
  for (const PoseReport& pose : outcome.poses) {
    text += pose.name + ": " + pose.reason + '\n';
    add(std::vector{pose.corner_rms_px, pose.symbol_rms_px, pose.held_out.disagreement});
  }
  return text;
}

/// Takes every core now and then, so that threads take turns at other moments in every run. Not more: the test machine
/// has its own load.
class Load {
 public:
  Load() {
    const unsigned count = std::max(std::thread::hardware_concurrency(), 1U) + 1;
    for (unsigned i = 0; i < count; ++i) {
      threads_.emplace_back([](const std::stop_token& stop) {
        while (!stop.stop_requested()) {
          const auto rest = std::chrono::steady_clock::now() + kTurn;
          while (std::chrono::steady_clock::now() < rest) continue;
          std::this_thread::sleep_for(9 * kTurn);
        }
      });
    }
  }

 private:
  static constexpr std::chrono::milliseconds kTurn{1};
  std::vector<std::jthread> threads_;
};

TEST(Calibrate, GivesTheSameBytesForTheSameInputBesideLoad) {
  const Observations observations = see_one_skewed(1.0);
  const auto alone = calibrate(observations, {});
  ASSERT_TRUE(alone) << alone.error().message;
  const Load load;
  std::vector<std::vector<char>> elsewhere;  // what follows lies at other addresses in each round
  for (int round = 0; round < 10; ++round) {
    const auto again = calibrate(observations, {});
    ASSERT_TRUE(again) << again.error().message;
    ASSERT_EQ(every_digit_of(*again), every_digit_of(*alone)) << "round " << round;
    elsewhere.emplace_back(100 << round);
  }
}

// A pose that is wholly wrong once drew the adjustment to a neighbouring minimum, by the last digits of the input.
TEST(Calibrate, IsNotDrawnToANeighbouringMinimumByTheLastDigits) {
  const Observations exact = see_one_skewed(1.0);
  const auto first = calibrate(exact, {});
  ASSERT_TRUE(first) << first.error().message;
  for (int variant = 0; variant < 50; ++variant) {
    std::mt19937 random(variant);
    std::uniform_real_distribution<double> noise_px(-1e-9, 1e-9);
    Observations observations = exact;
    const auto disturb = [&](auto& points) {
      for (auto& point : points) point.camera_px.x() += noise_px(random), point.camera_px.y() += noise_px(random);
    };
    for (PoseObservation& pose : observations.poses) disturb(pose.views[0].corners), disturb(pose.views[0].symbols);
    const auto outcome = calibrate(observations, {});
    ASSERT_TRUE(outcome) << outcome.error().message;
    ASSERT_EQ(left_out(*outcome), 1U) << "variant " << variant;
    ASSERT_TRUE(report_of(*outcome, "pose_5").fault) << "variant " << variant;
    ASSERT_NEAR(outcome->rig.cameras[0].lens[0] / first->rig.cameras[0].lens[0], 1, 1e-6) << "variant " << variant;
    ASSERT_NEAR(outcome->rig.projector.lens[0] / first->rig.projector.lens[0], 1, 1e-6) << "variant " << variant;
  }
}

TEST(Calibrate, LeavesOutOnePoseHoweverWrongItIs) {
  for (const double skew : {-2.0, -0.6, -0.1, 0.05, 0.2, 2.0}) {
    const auto outcome = calibrate(see_one_skewed(skew), {});
    ASSERT_TRUE(outcome) << outcome.error().message;
    EXPECT_EQ(left_out(*outcome), 1U) << skew;
    EXPECT_TRUE(report_of(*outcome, "pose_5").fault) << skew;
    expect_right_focal_lengths(*outcome);
  }
}

// Zhang's estimate of all of them is far off, and each of its own pair agrees with the other.
TEST(Calibrate, LeavesOutTwoPosesThatAreWrongInTheSameWay) {
  Observations observations = see_one_skewed(1.0, 10);
  for (BoardPoint& corner : observations.poses[2].views[0].corners) corner.camera_px.x() += corner.camera_px.y();
  for (ProjectedPoint& symbol : observations.poses[2].views[0].symbols) symbol.camera_px.x() += symbol.camera_px.y();
  const auto outcome = calibrate(observations, {});
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_EQ(left_out(*outcome), 2U);
  EXPECT_TRUE(report_of(*outcome, "pose_2").fault && report_of(*outcome, "pose_5").fault);
  expect_right_focal_lengths(*outcome);
}

// The cameras are placed by a pose that both see: not by the wrong one.
TEST(Calibrate, PlacesCamerasByPosesThatAreRight) {
  const RigModel truth = true_rig(2);
  Observations observations = see(truth, true_poses(8));
  for (BoardPoint& corner : observations.poses[0].views[1].corners) corner.camera_px.x() += corner.camera_px.y();
  const auto outcome = calibrate(observations, {});
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_EQ(left_out(*outcome), 1U);
  EXPECT_TRUE(report_of(*outcome, "pose_0").fault);
  expect_near_truth(*outcome, truth);
}

}  // namespace
}  // namespace slsd
