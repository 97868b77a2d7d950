// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/verify/verify_from_files.hpp"
#include "core/calibration_file/calibration_file.hpp"

#include <cstdlib>
#include <fstream>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include "tests/programs/calibrate/simulated_captures.hpp"

namespace slsd {
namespace {

using std::filesystem::path;
using testing::HasSubstr;

/// One view of a board, and a calibration that each test writes.
class VerifyFromFiles : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = testing::TempDir() + "slsd-verify-XXXXXX";
    if (mkdtemp(name.data()) == nullptr) std::abort();
    home_ = name;
    std::ofstream(home_ / "slsd.toml") << "[projector]\nwidth_px = 640\nheight_px = 400\n"
                                          "[calibration]\nfile = \"calibration.yml\"\n";
    PatternOptions options;
    options.projector_width_px = 640, options.projector_height_px = 400;
    write_simulated_pose(pose(), small_rig(), *parse_board(kSimulatedBoard), *make_pattern(options), simulated_pose(1));
    calibrated_.report.board = kSimulatedBoard;
    request_.configuration_file = home_ / "slsd.toml";
    request_.from = home_ / "captures";
  }
  void TearDown() override { std::filesystem::remove_all(home_); }

  [[nodiscard]] path pose() const { return home_ / "captures/pose_00"; }
  Result<> verify() {
    std::ofstream(home_ / "calibration.yml") << write_calibration(calibrated_);
    return verify_from_files(request_);
  }
  /// As if the projector had been turned since.
  void turn_projector(const Eigen::Vector3d& axis, double angle_rad) {
    RigidTransform& motion = calibrated_.cameras[0].projector_from_camera;
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle_rad, axis).toRotationMatrix();
    motion = {turn * motion.rotation, turn * motion.translation};
  }

  path home_;
  Calibration calibrated_ = small_rig();
  CalibrateRequest request_;
};

TEST_F(VerifyFromFiles, PassesTheCalibrationThatIsTrue) {
  const auto done = verify();
  EXPECT_TRUE(done) << to_string(done.error());
}

TEST_F(VerifyFromFiles, MissesTheBoardThatIsAskedFor) {
  std::filesystem::remove(pose() / "white.png");
  request_.board = kSimulatedBoard;
  const auto without = verify();
  ASSERT_FALSE(without);
  EXPECT_EQ(without.error().code, ErrorCode::kNotFound);
}

TEST_F(VerifyFromFiles, FailsOfARigThatWasKnocked) {
  turn_projector(Eigen::Vector3d::UnitX(), 0.003);
  const auto done = verify();
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().code, ErrorCode::kMismatch);
  EXPECT_THAT(done.error().message, HasSubstr("calibrate again"));
}

TEST_F(VerifyFromFiles, FailsOfABoardOfAnotherSize) {
  request_.board = "charuco:7x5:61:45.75:DICT_5X5_100";
  const auto done = verify();
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error().message, HasSubstr("--ruler"));
}

TEST_F(VerifyFromFiles, TakesTheRulerOfABoardThatIsNamed) {
  request_.ruler = "200:200";
  const auto alone = verify();
  ASSERT_FALSE(alone);
  EXPECT_EQ(alone.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(to_string(alone.error()), HasSubstr("--ruler 200:200: needs --board, which names the print"));
  request_.board = kSimulatedBoard;
  const auto done = verify();
  EXPECT_TRUE(done) << to_string(done.error());
}

TEST_F(VerifyFromFiles, NeedsACalibration) {
  std::ofstream(home_ / "slsd.toml") << "[projector]\nwidth_px = 640\nheight_px = 400\n";
  const auto done = verify();
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error().message, HasSubstr("no calibration to verify"));
}

}  // namespace
}  // namespace slsd
