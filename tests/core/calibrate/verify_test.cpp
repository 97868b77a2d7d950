// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/verify/verify.hpp"

#include <cmath>
#include <random>

#include <gmock/gmock.h>

#include "tests/core/calibrate/knocked_rig.hpp"
#include "tests/core/calibrate/synthetic_rig.hpp"

namespace slsd {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Not;

const std::vector<NamedCamera> kNames{{"camera0", {1600, 1200}}};

std::vector<PoseView> views_of(const Observations& observations) {
  std::vector<PoseView> views;
  for (const PoseObservation& pose : observations.poses) views.push_back(pose.views.front());
  return views;
}

PoseView a_view(const SightOptions& options = {}) {
  return views_of(see(true_rig(), true_poses(1), options)).front();
}

Result<ViewCheck> check(const PoseView& view, const RigModel& rig = true_rig()) {
  const Calibration calibration = rig.calibration(kNames);
  return check_view(view, calibration.cameras.front(), calibration.projector);
}

std::vector<VerifyFault> faults(const PoseView& view, const RigModel& rig = true_rig()) {
  const auto checked = check(view, rig);
  EXPECT_TRUE(checked) << checked.error().message;
  return checked ? find_faults(*checked, {}) : std::vector<VerifyFault>{};
}

TEST(CheckView, PassesTheRigThatWasCalibrated) {
  for (const PoseView& view : views_of(see(true_rig(), true_poses(6)))) {
    const auto checked = check(view);
    ASSERT_TRUE(checked) << checked.error().message;
    EXPECT_THAT(find_faults(*checked, {}), IsEmpty());
    EXPECT_LT(checked->epipolar_rms_px, 0.1);
    EXPECT_NEAR(checked->distance_mm, 1925, 325);
    ASSERT_TRUE(checked->trueness);
    EXPECT_EQ(checked->trueness->corners, 70U);
    EXPECT_NEAR(checked->trueness->scale_percent, 0, 0.05);
    EXPECT_LT(checked->trueness->long_rms_percent, 0.1);
  }
}

TEST(CheckView, ExpectsThePlaneToBeAsFlatAsTheNoiseLetsIt) {
  SightOptions options;
  options.symbol_sigma_px = 0.05;  // as the symbols say of themselves
  const auto checked = check(a_view(options));
  ASSERT_TRUE(checked) << checked.error().message;
  EXPECT_NEAR(checked->plane_rms_mm / checked->plane_sigma_mm, 1, 0.15);
}

// Symbols on a printed board are noisier than they say of themselves.
TEST(CheckView, HasNoFalseAlarmInTwoHundredViews) {
  int views = 0;
  for (const double noise_px : {0.05, 0.1, 0.15, 0.2}) {
    SightOptions options;
    options.symbol_sigma_px = noise_px, options.seed = static_cast<std::uint32_t>(1000 * noise_px);
    for (const PoseView& view : views_of(see(true_rig(), true_poses(50, options.seed), options))) {
      EXPECT_THAT(faults(view), IsEmpty()) << "view " << ++views << ", symbols off by " << noise_px << " px";
    }
  }
}

TEST(CheckView, FindsATurnByATwentiethOfADegreeAboutEachAxis) {
  constexpr double kTurnMrad = 0.05 / 57.29578 * 1000;
  for (const Eigen::Vector3d& axis : {Eigen::Vector3d(1, 0, 0), {0, 1, 0}, {0, 0, 1}, {0, 0, -1}, {0.6, 0, 0.8}}) {
    SightOptions options;
    options.symbol_sigma_px = 0.2;
    for (const PoseView& view : views_of(see(true_rig(), true_poses(20), options))) {
      EXPECT_THAT(faults(view, knocked(true_rig(), kTurnMrad * axis)), Not(IsEmpty())) << axis.transpose();
    }
  }
}

TEST(CheckView, SaysWhichTurnAPlainPlaneDoesNotShow) {
  PoseView plain = a_view();
  plain.corners.clear();
  const auto checked = check(plain);
  ASSERT_TRUE(checked) << checked.error().message;
  ASSERT_TRUE(checked->blind_axis);
  EXPECT_GT(std::abs(checked->blind_axis->y()), 0.95) << "along the epipolar lines, which run from left to right";
  EXPECT_LT(checked->turn_deg, 0.01);
}

TEST(CheckView, FindsAProjectorThatWasTurnedAcrossTheEpipolarLines) {
  EXPECT_THAT(faults(a_view(), knocked(true_rig(), {1, 0, 0})), Contains(VerifyFault::kEpipolar));
}

TEST(CheckView, FindsATurnAlongTheEpipolarLinesByTheDistances) {
  const std::vector<VerifyFault> found = faults(a_view(), knocked(true_rig(), {0, 1, 0}));
  EXPECT_THAT(found, Not(Contains(VerifyFault::kEpipolar)));
  EXPECT_THAT(found, Contains(VerifyFault::kScale));
}

TEST(CheckView, FindsABoardOfAnotherScale) {
  PoseView view = a_view();
  for (BoardPoint& corner : view.corners) corner.board_mm /= 1.005;
  const auto checked = check(view);
  ASSERT_TRUE(checked) << checked.error().message;
  EXPECT_NEAR(checked->trueness->scale_percent, 0.5, 0.05);
  EXPECT_THAT(find_faults(*checked, {}), ElementsAre(VerifyFault::kScale));
}

TEST(CheckView, FindsDistancesThatAreWrongEachByItsOwnShare) {
  PoseView view = a_view();
  for (BoardPoint& corner : view.corners) corner.board_mm.y() *= 1 + 0.0001 * (corner.board_mm.x() - 225);
  EXPECT_THAT(faults(view), ElementsAre(VerifyFault::kDistances));
}

TEST(CheckView, FindsABend) {
  SightOptions options;
  options.relief = [](int, const Eigen::Vector2d& mm) { return 12 * std::pow(mm.x() / 225 - 1, 2); };
  EXPECT_THAT(faults(a_view(options)), Contains(VerifyFault::kPlane));
}

TEST(CheckView, LeavesOutWhatWasMisread) {
  PoseView view = a_view();
  std::mt19937 random(3);
  std::size_t misread = 0;
  for (ProjectedPoint& symbol : view.symbols) {
    if (random() % 20 != 0) continue;
    symbol.projector_px = {static_cast<double>(random() % 1280), static_cast<double>(random() % 800)};
    ++misread;
  }
  const auto checked = check(view);
  ASSERT_TRUE(checked) << checked.error().message;
  EXPECT_THAT(find_faults(*checked, {}), IsEmpty());
  EXPECT_GE(checked->left_out + 2, misread);  // one in some hundred falls where it belongs by chance
  EXPECT_LE(checked->left_out, misread + 5);
}

TEST(CheckView, TakesAPlainPlaneWithoutDistances) {
  PoseView view = a_view();
  view.corners.clear();
  const auto checked = check(view);
  ASSERT_TRUE(checked) << checked.error().message;
  EXPECT_FALSE(checked->trueness);
  EXPECT_THAT(find_faults(*checked, {}), IsEmpty());
}

TEST(CheckView, RefusesTwoPlanes) {
  const std::vector<PoseView> views = views_of(see(true_rig(), true_poses(2)));
  PoseView both = views[0];
  both.symbols.insert(both.symbols.end(), views[1].symbols.begin(), views[1].symbols.end());
  const auto checked = check(both);
  ASSERT_FALSE(checked);
  EXPECT_EQ(checked.error().code, ErrorCode::kImpossible);
}

TEST(CheckView, RefusesTooFewSymbols) {
  PoseView view = a_view();
  view.symbols.resize(20);
  const auto checked = check(view);
  ASSERT_FALSE(checked);
  EXPECT_EQ(checked.error().code, ErrorCode::kNotFound);
}

TEST(EpipolarLimit, FollowsWhatTheCalibrationSays) {
  EXPECT_EQ(epipolar_limit_px(std::nullopt), 0.5);
  EXPECT_EQ(epipolar_limit_px(0.1), 0.5);
  EXPECT_DOUBLE_EQ(epipolar_limit_px(0.3), 0.9);
}

TEST(Summarise, PoolsTheViewsAndNamesEachFaultOnce) {
  ViewCheck good;
  good.symbols = 100, good.distance_mm = 2000, good.epipolar_rms_px = 0.1;
  good.plane_rms_mm = good.plane_sigma_mm = 0.3;
  ViewCheck off = good;
  off.symbols = 300, off.epipolar_rms_px = 0.7;
  good.trueness = Trueness{50, 0.05, 0.06, 0.1};
  const VerifySummary summary = summarise({good, off, off}, {});
  EXPECT_EQ(summary.views, 3U);
  EXPECT_EQ(summary.views_with_board, 1U);
  EXPECT_NEAR(summary.epipolar_rms_px, std::sqrt((100 * 0.01 + 600 * 0.49) / 700), 1e-12);
  EXPECT_NEAR(summary.plane_percent, 0.015, 1e-12);
  EXPECT_DOUBLE_EQ(summary.scale_percent, 0.05);
  EXPECT_THAT(summary.faults, ElementsAre(VerifyFault::kEpipolar));
  EXPECT_THAT(summarise({good}, {}).faults, IsEmpty());
}

}  // namespace
}  // namespace slsd
