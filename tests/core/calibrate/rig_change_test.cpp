// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// A session is one rig: a device that was knocked between two poses is named, and boards are not blamed for it.
#include <numbers>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include "core/calibrate/calibrate.hpp"
#include "tests/core/calibrate/outcome.hpp"
#include "tests/core/calibrate/synthetic_rig.hpp"

namespace slsd {
namespace {

using test::left_out;
using test::report_of;
using testing::AllOf;
using testing::HasSubstr;

enum class Device { kCamera, kProjector };

/// The rig with a device turned about its own centre.
RigModel turned(const RigModel& rig, Device device, const Eigen::Vector3d& axis, double degrees) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(degrees * std::numbers::pi / 180, axis.normalized()).toRotationMatrix();
  RigModel after = rig;
  RigidTransform place = to_motion(rig.projector.device_from_rig);
  const RigidTransform by{turn, Eigen::Vector3d::Zero()};
  after.projector.device_from_rig = to_vector(device == Device::kCamera ? place.after(by) : by.after(place));
  return after;
}

/// What a session sees whose rig becomes another from a pose on. The board stays where it was for the room, so that for
/// a camera that turned it is elsewhere: as no pose is known beforehand, nothing tells.
Observations see_change(const RigModel& before, const RigModel& after, std::size_t first, int poses,
                        std::uint32_t seed = 1) {
  const std::vector<MotionVector> places = true_poses(poses, seed);
  SightOptions options;
  options.seed = seed;
  Observations seen = see(before, places, options);
  const Observations then = see(after, places, options);
  for (std::size_t i = first; i < seen.poses.size(); ++i) seen.poses[i] = then.poses[i];
  return seen;
}

TEST(RigChange, NamesTheDeviceAndTheMoment) {
  struct Case {
    Device device;
    Eigen::Vector3d axis;
    double degrees;
    std::size_t first;
    const char* named;
  };
  for (const Case& one : {Case{Device::kCamera, {0, 1, 0}, 0.1, 8, "camera"},
                          {Device::kCamera, {1, 0, 0}, 0.1, 8, "camera"},
                          {Device::kCamera, {0, 0, 1}, 0.1, 8, "camera"},
                          {Device::kProjector, {0, 1, 0}, 0.1, 8, "projector"},
                          {Device::kProjector, {0.3, 1, 0.2}, 0.1, 3, "the projector moved"},
                          {Device::kCamera, {0.3, 1, 0.2}, 1, 6, "the camera moved"},
                          {Device::kCamera, {0.2, 1, 0.3}, 0.1, 10, "camera"},
                          {Device::kProjector, {1, 1, 1}, 0.05, 2, "projector"}}) {
    const RigModel truth = true_rig();
    const auto outcome =
        calibrate(see_change(truth, turned(truth, one.device, one.axis, one.degrees), one.first, 12), {});
    ASSERT_FALSE(outcome) << one.named << " at " << one.first;
    EXPECT_EQ(outcome.error().code, ErrorCode::kImpossible);
    EXPECT_THAT(outcome.error().message, AllOf(HasSubstr("the rig moved during the session"), HasSubstr(one.named),
                                               HasSubstr("between pose_" + std::to_string(one.first - 1) +
                                                         " and pose_" + std::to_string(one.first))));
    // Parts of fewer than three poses are none to calibrate by.
    const auto named = [&](const std::string& part) { return outcome.error().message.find(part) != std::string::npos; };
    EXPECT_EQ(named("--use pose_" + std::to_string(one.first) + ":pose_11 has the rig as it is now"), one.first < 10);
    EXPECT_EQ(named("--use pose_0:pose_" + std::to_string(one.first - 1) + " has the rig as it was before"),
              one.first > 2);
    EXPECT_EQ(named("only 2 poses show the rig as it is now, but 3 are needed"), one.first == 10);
  }
}

// So far that no start suits both parts.
TEST(RigChange, NamesAMomentOfALargeTurn) {
  for (const double degrees : {2.0, 5.0}) {
    for (const std::size_t first : {2U, 5U, 7U}) {
      for (const Eigen::Vector3d& axis : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0.1, 1, 0.3)}) {
        for (const Device device : {Device::kCamera, Device::kProjector}) {
          const RigModel truth = true_rig();
          const auto outcome = calibrate(see_change(truth, turned(truth, device, axis, degrees), first, 10), {});
          ASSERT_FALSE(outcome) << degrees << " degrees at " << first;
          EXPECT_THAT(outcome.error().message, AllOf(HasSubstr("the rig moved during the session"),
                                                     HasSubstr("between pose_" + std::to_string(first - 1) +
                                                               " and pose_" + std::to_string(first))))
              << degrees << " degrees at " << first;
        }
      }
    }
  }
}

TEST(RigChange, FindsASecondCameraThatMoved) {
  const RigModel truth = true_rig(2);
  RigModel after = truth;
  after.cameras[1].device_from_rig[1] += 0.1 * std::numbers::pi / 180;
  const auto outcome = calibrate(see_change(truth, after, 7, 10), {});
  ASSERT_FALSE(outcome);
  EXPECT_THAT(outcome.error().message,
              AllOf(HasSubstr("camera camera1 moved"), HasSubstr("between pose_6 and pose_7")));
}

// Of one pose alone nobody can tell that the rig changed, but the print tells that the board did not move.
TEST(RigChange, OfOnePoseIsNotBlamedOnABoardWhosePrintStayed) {
  const RigModel truth = true_rig();
  for (const std::size_t first : {1U, 11U}) {  // the pose before it, or it, alone
    for (const bool seen_to_stay : {true, false}) {
      Observations seen = see_change(truth, turned(truth, Device::kCamera, {0, 1, 0}, 0.3), first, 12);
      for (PoseObservation& pose : seen.poses) {
        if (seen_to_stay) pose.views[0].shift_px = Eigen::Vector2d::Zero();
      }
      const auto outcome = calibrate(seen, {});
      ASSERT_TRUE(outcome) << outcome.error().message;
      const PoseReport& alone = report_of(*outcome, first == 1 ? "pose_0" : "pose_11");
      EXPECT_TRUE(alone.fault);
      EXPECT_EQ(alone.reason.find("the camera or the projector moved since the other poses") != std::string::npos,
                seen_to_stay)
          << alone.reason;
    }
  }
}

// By less than its print would tell.
TEST(RigChange, LeavesABoardThatMovedALittleTheBlame) {
  SightOptions options;
  options.moved = [](int pose, const MotionVector& before) {
    MotionVector after = before;
    if (pose == 7) after[5] += 6, after[1] += 0.005;
    return after;
  };
  Observations seen = see(true_rig(), true_poses(12), options);
  for (PoseObservation& pose : seen.poses) pose.views[0].shift_px = Eigen::Vector2d::Zero();
  const auto outcome = calibrate(seen, {});
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_EQ(report_of(*outcome, "pose_7").fault, PoseFault::kMoved) << report_of(*outcome, "pose_7").reason;
}

// The camera turned, and one board was moved between its pictures besides.
TEST(RigChange, IsFoundBesideAWrongPose) {
  const RigModel truth = true_rig();
  Observations seen = see_change(truth, turned(truth, Device::kCamera, {0.1, 1, 0}, 0.1), 8, 12);
  SightOptions options;
  options.moved = [](int, const MotionVector& before) {
    MotionVector after = before;
    after[5] += 10, after[0] += 0.01;
    return after;
  };
  seen.poses[3] = see(truth, true_poses(12), options).poses[3];
  const auto outcome = calibrate(seen, {});
  ASSERT_FALSE(outcome);
  EXPECT_THAT(outcome.error().message, HasSubstr("between pose_7 and pose_8"));
}

// Boards that moved, each in its own way, are no device that did.
TEST(RigChange, LeavesBoardsTheBlame) {
  SightOptions options;
  options.moved = [](int pose, const MotionVector& before) {
    MotionVector after = before;
    if (pose == 9) after[5] += 6, after[1] += 0.005;
    if (pose == 10) after[5] -= 8, after[0] += 0.004;
    if (pose == 11) after[5] += 5, after[1] -= 0.006;
    return after;
  };
  const auto outcome = calibrate(see(true_rig(), true_poses(12), options), {});
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_EQ(left_out(*outcome), 3U);
  for (const char* pose : {"pose_9", "pose_10", "pose_11"}) {
    EXPECT_EQ(report_of(*outcome, pose).fault, PoseFault::kMoved) << report_of(*outcome, pose).reason;
  }
}

// Of rigs that stayed as they were, with points that are off in common as those of a board that is not quite flat.
TEST(RigChange, RefusesNoRigThatStayed) {
  for (std::uint32_t trial = 0; trial < 40; ++trial) {
    SightOptions options;
    options.seed = trial;
    if (trial % 2 == 1) {
      options.relief = [trial](int pose, const Eigen::Vector2d& mm) {
        return 0.1 * std::sin(pose + 1.3 * trial) * std::pow((mm.x() - 225) / 225, 2);
      };
    }
    const auto outcome = calibrate(see(true_rig(), true_poses(5 + static_cast<int>(trial) % 9, trial), options), {});
    EXPECT_TRUE(outcome) << "trial " << trial << ": " << outcome.error().message;
  }
}

}  // namespace
}  // namespace slsd
