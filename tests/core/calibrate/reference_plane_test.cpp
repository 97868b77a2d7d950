// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/verify/reference_plane.hpp"

#include <cmath>
#include <map>
#include <string>

#include <gmock/gmock.h>

#include "core/calibrate/calibrate.hpp"
#include "tests/core/calibrate/outcome.hpp"
#include "tests/core/calibrate/synthetic_rig.hpp"

namespace slsd {
namespace {

using test::report_of;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr int kPoses = 8;
/// Near, middle and far, facing the camera but for some degrees.
const std::vector<MotionVector> kPlaces{
    {0.1, -0.1, 0, -215, -160, 1600}, {-0.15, 0.2, 0, -225, -150, 1900}, {0.05, 0.1, 0, -235, -140, 2300}};

/// As if seen at a seventh of the symbols, which is enough here, and quicker.
Observations look_at(const RigModel& truth, const std::vector<MotionVector>& places, const SightOptions& options = {}) {
  Observations observations = see(truth, places, options);
  for (PoseObservation& pose : observations.poses) {
    for (PoseView& view : pose.views) {
      std::size_t i = 0;
      std::erase_if(view.symbols, [&](const auto&) { return i++ % 7 != 0; });
    }
  }
  return observations;
}

/// @param print  how large the plane's print is against what it should be
void add_planes(const RigModel& truth, const std::vector<MotionVector>& places, const SightOptions& options,
                Observations& observations, double print = 1) {
  for (PoseObservation& plane : look_at(truth, places, options).poses) {
    plane.name = "plane_" + std::to_string(observations.count(PoseSubject::kPlane));
    plane.subject = PoseSubject::kPlane;
    for (PoseView& view : plane.views) {
      for (BoardPoint& corner : view.corners) corner.board_mm /= print;
    }
    observations.poses.push_back(std::move(plane));
  }
}

Observations poses_and_planes(double print = 1, const SightOptions& options = {}) {
  Observations observations = look_at(true_rig(), true_poses(kPoses));
  add_planes(true_rig(), kPlaces, options, observations, print);
  return observations;
}

CalibrationOutcome calibrated(Observations observations) {
  auto outcome = calibrate(std::move(observations), {});
  if (!outcome) throw std::runtime_error(outcome.error().message);
  return std::move(*outcome);
}

double baseline_mm(const CalibrationOutcome& outcome) {
  return to_motion(outcome.rig.projector.device_from_rig).translation.norm();
}

/// What is true of a device's parameter: fx fy cx cy, and the projector's place and turns.
std::map<std::string, double> errors_of(const CalibrationOutcome& outcome, const RigModel& truth) {
  std::map<std::string, double> errors;
  for (std::size_t i = 0; i < 4; ++i) {
    errors["camera " + std::to_string(i)] = outcome.rig.cameras[0].lens[i] - truth.cameras[0].lens[i];
    errors["projector " + std::to_string(i)] = outcome.rig.projector.lens[i] - truth.projector.lens[i];
  }
  for (std::size_t i = 0; i < 6; ++i) {
    errors["motion " + std::to_string(i)] =
        outcome.rig.projector.device_from_rig[i] - truth.projector.device_from_rig[i];
  }
  return errors;
}

TEST(ReferencePlane, ImprovesTheRigWhereThePosesAreFewAndNoisy) {
  const RigModel truth = true_rig();
  constexpr std::uint32_t kTrials = 6;
  std::map<std::string, double> without, with;
  for (std::uint32_t trial = 0; trial < kTrials; ++trial) {
    SightOptions noisy;
    noisy.corner_sigma_px = 0.1, noisy.symbol_sigma_px = 0.2, noisy.seed = trial + 1;
    Observations observations = look_at(truth, true_poses(5, trial + 1), noisy);
    for (const auto& [name, error] : errors_of(calibrated(observations), truth)) without[name] += error * error;
    SightOptions other = noisy;
    other.seed += 100;
    add_planes(truth, kPlaces, other, observations);
    const CalibrationOutcome outcome = calibrated(observations);
    for (const auto& [name, error] : errors_of(outcome, truth)) with[name] += error * error;
    EXPECT_THAT(outcome.warnings, IsEmpty());
  }
  double logarithms = 0;
  for (const auto& [name, square] : with) {
    const double share = std::sqrt(square / without[name]);
    EXPECT_LT(share, 1.1) << name;  // of six trials it is known to a tenth
    logarithms += std::log(share) / static_cast<double>(with.size());
  }
  EXPECT_LT(std::exp(logarithms), 0.8);
}

TEST(ReferencePlane, IsMeasuredByEveryCameraBeforeAndAfter) {
  const RigModel truth = true_rig(2);
  Observations observations = look_at(truth, true_poses(kPoses));
  add_planes(truth, kPlaces, {}, observations);
  const CalibrationOutcome outcome = calibrated(std::move(observations));
  ASSERT_EQ(outcome.planes.size(), 6U);
  EXPECT_EQ(outcome.planes[0].camera, "camera0");
  EXPECT_EQ(outcome.planes[1].camera, "camera1");
  for (const PlaneCheck& plane : outcome.planes) {
    ASSERT_TRUE(plane.before && plane.after) << plane.name;
    EXPECT_LT(plane.before->plane_rms_mm, 1.5 * 0.08 / 0.05 * plane.before->plane_sigma_mm);
    EXPECT_NEAR(plane.before->trueness->scale_percent, 0, 0.1);
    EXPECT_NEAR(plane.after->trueness->scale_percent, 0, 0.1);
  }
  EXPECT_EQ(outcome.observations.count(PoseSubject::kPlane), 3U);
  EXPECT_EQ(report_of(outcome, "plane_1").subject, PoseSubject::kPlane);
  EXPECT_EQ(summarise(outcome.planes, &PlaneCheck::before).views_with_board, 6U);
  EXPECT_LT(summarise(outcome.planes, &PlaneCheck::after).long_rms_percent, 0.1);
}

TEST(ReferencePlane, SaysThatThePrintsAreNotOfOneScale) {
  const CalibrationOutcome outcome = calibrated(poses_and_planes(1.005));
  ASSERT_EQ(outcome.warnings.size(), 1U);
  EXPECT_THAT(outcome.warnings[0], HasSubstr("the board is 0.50 +- 0.0"));
  EXPECT_THAT(outcome.warnings[0], HasSubstr("smaller than it should be"));
  EXPECT_EQ(outcome.verdict.grade, Grade::kUsable);
  EXPECT_NEAR(outcome.rig.board_scale, 1 / 1.005 - 1, 0.0003);
  // The plane is the measure: it says that 1.005 mm are 1 mm.
  const double truth = to_motion(true_rig().projector.device_from_rig).translation.norm();
  EXPECT_NEAR(baseline_mm(outcome) / truth, 1 / 1.005, 0.0005);
  for (const PoseReport& pose : outcome.poses) EXPECT_FALSE(pose.fault) << pose.name << ": " << pose.reason;
}

TEST(ReferencePlane, HoldsTheScaleWherePrintsAgree) {
  const CalibrationOutcome outcome = calibrated(poses_and_planes(1.0004));
  EXPECT_THAT(outcome.warnings, IsEmpty());
  EXPECT_EQ(outcome.rig.board_scale, 0);
  EXPECT_EQ(std::ranges::count(outcome.parameters, "board_scale", &ParameterReport::name), 0);
}

TEST(ReferencePlane, DoesNotTakePartInTheStretchOfTheBoard) {
  Observations observations = look_at(true_rig(), true_poses(kPoses), {.relief = {}, .moved = {}, .stretch = 0.02});
  add_planes(true_rig(), kPlaces, {}, observations);
  const CalibrationOutcome outcome = calibrated(std::move(observations));
  ASSERT_EQ(outcome.warnings.size(), 1U) << testing::PrintToString(outcome.warnings);
  EXPECT_THAT(outcome.warnings[0], HasSubstr("stretched"));
  EXPECT_NEAR(outcome.rig.board_stretch, 0.02, 0.001);
  EXPECT_EQ(report_of(outcome, "plane_0").outlying_corners, 0U);
}

TEST(ReferencePlane, NamesViewsThatAreBentOrShowTooLittle) {
  SightOptions options;
  options.relief = [](int pose, const Eigen::Vector2d& mm) {
    return pose == 1 ? 4 * std::pow((mm.x() - 225) / 225, 2) : 0;
  };
  Observations observations = look_at(true_rig(), true_poses(kPoses));
  std::vector<MotionVector> places = kPlaces;
  places.push_back({0.2, 0.1, 0, -225, -150, 1750});
  add_planes(true_rig(), places, options, observations);
  observations.poses[kPoses].views[0].symbols.resize(5);
  const CalibrationOutcome outcome = calibrated(std::move(observations));
  EXPECT_EQ(report_of(outcome, "plane_0").fault, PoseFault::kTooFewSymbols);
  const PoseReport& bent = report_of(outcome, "plane_1");
  EXPECT_EQ(bent.fault, PoseFault::kBent) << bent.reason;
  EXPECT_THAT(bent.reason, HasSubstr("the plane is not flat"));
  EXPECT_EQ(outcome.observations.poses.size(), kPoses + 2U);
  ASSERT_EQ(outcome.planes.size(), 3U);
  EXPECT_TRUE(outcome.planes[0].before);
  EXPECT_FALSE(outcome.planes[0].after);
}

TEST(ReferencePlane, NamesAViewThatMoved) {
  SightOptions options;
  options.moved = [](int pose, const MotionVector& before) {
    MotionVector after = before;
    if (pose == 2) after[5] += 10, after[1] += 0.005;
    return after;
  };
  const CalibrationOutcome outcome = calibrated(poses_and_planes(1.005, options));
  EXPECT_EQ(report_of(outcome, "plane_2").fault, PoseFault::kMoved) << report_of(outcome, "plane_2").reason;
  EXPECT_EQ(outcome.observations.count(PoseSubject::kPlane), 2U);
}

TEST(ReferencePlane, IsNoMeasureByOneViewThatContradicts) {
  Observations observations = look_at(true_rig(), true_poses(kPoses));
  add_planes(true_rig(), {kPlaces[1]}, {}, observations, 1.01);
  const CalibrationOutcome outcome = calibrated(std::move(observations));
  EXPECT_TRUE(report_of(outcome, "plane_0").fault);
  EXPECT_THAT(report_of(outcome, "plane_0").reason, HasSubstr("distances on it are"));
  EXPECT_THAT(outcome.warnings, ElementsAre(HasSubstr("no view of the reference plane")));
}

TEST(ReferencePlane, CannotStandForThePoses) {
  Observations observations = look_at(true_rig(), true_poses(2));
  add_planes(true_rig(), kPlaces, {}, observations);
  const auto outcome = calibrate(std::move(observations), {});
  ASSERT_FALSE(outcome);
  EXPECT_THAT(outcome.error().message, HasSubstr("2 of the poses can be used, but at least 3 are needed"));
}

}  // namespace
}  // namespace slsd
