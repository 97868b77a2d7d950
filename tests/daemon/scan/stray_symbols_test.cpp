// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/cloud/reconstruct.hpp"

#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <sstream>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include "daemon/scan/cloud/calibration_watch.hpp"
#include "drivers/camera/frame_pool.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

constexpr double kKnockMrad = 2;

/// The paper's rig, whose camera was turned about its own centre across the epipolar lines.
Calibration knocked_rig() {
  Calibration rig = paper_rig();
  RigidTransform& pose = rig.cameras.front().projector_from_camera;
  pose.rotation = pose.rotation * Eigen::AngleAxisd(kKnockMrad / 1000, Eigen::Vector3d::UnitX());
  return rig;
}

Grey8 seen_of(const Pattern& pattern, const Calibration& rig) {
  return simulate(draw_pattern(pattern), rig, plane({0, 0, 2000}, {0, 0, 1}));
}

/// A service's setup with the calibration from before the knock.
std::shared_ptr<ScanSetup> setup_before() {
  const Pattern pattern = *make_pattern({});
  auto setup = std::make_shared<ScanSetup>(ScanSetup{pattern, draw_pattern(pattern), paper_rig(), {"camera"}, {}});
  setup->lanes.emplace_back().push_back(std::move(*Decoder::create(pattern, paper_rig(), 0, {})));
  return setup;
}

ScanResult scan(ScanSetup& setup, const Grey8& seen) {
  FramePool pool({seen.width(), seen.height(), 1}, 1);
  FrameSet set;
  set.frames.push_back(std::move(*pool.lend(seen.view(), 1, std::chrono::steady_clock::now())));
  auto result = reconstruct(set, setup, 0, {}, "scan");
  EXPECT_TRUE(result);
  return std::move(*result);
}

TEST(StraySymbols, AreThoseOfAKnockedRig) {
  const auto setup = setup_before();
  const ScanResult knocked = scan(*setup, seen_of(setup->pattern, knocked_rig()));
  EXPECT_LT(knocked.cloud.points.size(), 100U);
  EXPECT_GT(knocked.strays.size(), 2000U);
}

TEST(StraySymbols, AreNoneOfARigAsItWasCalibrated) {
  const auto setup = setup_before();
  const ScanResult fine = scan(*setup, seen_of(setup->pattern, paper_rig()));
  EXPECT_GT(fine.cloud.points.size(), 2000U);
  EXPECT_TRUE(fine.strays.empty());
}

TEST(StraySymbols, AreNoneOfAnotherPattern) {
  const auto setup = setup_before();
  PatternOptions other;
  other.seed = 2;
  EXPECT_TRUE(scan(*setup, seen_of(*make_pattern(other), paper_rig())).strays.empty());
}

TEST(CalibrationWatch, NamesAKnockThatLeavesNoPoints) {
  const auto setup = setup_before();
  const ScanResult fine = scan(*setup, seen_of(setup->pattern, paper_rig()));
  const ScanResult knocked = scan(*setup, seen_of(setup->pattern, knocked_rig()));
  CalibrationWatch watch;
  std::uint64_t number = 0;
  while (number < 30) watch.note(setup, fine, ++number);
  EXPECT_FALSE(watch.states().front().off_since_scan);
  while (number < 150) watch.note(setup, knocked, ++number);  // until the average has forgotten what was before
  const DriftState state = watch.states().front();
  EXPECT_EQ(state.off_since_scan, 31U);
  EXPECT_NEAR(state.epipolar_px, kKnockMrad / 1000 * paper_rig().projector.fy, 0.7);
}

TEST(CalibrationWatch, LogsTheRemedyOfAKnock) {
  std::ostringstream log;
  const auto logger_before = spdlog::default_logger();
  spdlog::set_default_logger(
      std::make_shared<spdlog::logger>("", std::make_shared<spdlog::sinks::ostream_sink_st>(log)));
  const auto setup = setup_before();
  const ScanResult knocked = scan(*setup, seen_of(setup->pattern, knocked_rig()));
  CalibrationWatch watch;
  for (std::uint64_t number = 1; number < 150; ++number) watch.note(setup, knocked, number);
  spdlog::set_default_logger(logger_before);
  EXPECT_THAT(log.str(), testing::AllOf(testing::HasSubstr("knocked out of its calibration since scan"),
                                        testing::HasSubstr("run slsd --correct")));
}

}  // namespace
}  // namespace slsd
