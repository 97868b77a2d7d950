// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cstdlib>
#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include "core/calibration_file/calibration_file.hpp"
#include "programs/verify/keep_correction.hpp"
#include "programs/verify/verify_from_files.hpp"
#include "tests/programs/calibrate/simulated_captures.hpp"

namespace slsd {
namespace {

using std::filesystem::path;
using testing::AllOf;
using testing::HasSubstr;

constexpr double kTurnRad = 0.1 / 57.29578;

/// One view of a board, by a rig whose projector turned by 0.1 degrees since it was calibrated.
class CorrectFromFiles : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = testing::TempDir() + "slsd-correct-XXXXXX";
    if (mkdtemp(name.data()) == nullptr) std::abort();
    home_ = name;
    std::ofstream(home_ / "slsd.toml") << "[projector]\nwidth_px = 640\nheight_px = 400\n"
                                          "[calibration]\nfile = \"calibration.yml\"\n";
    calibrated_.report.board = kSimulatedBoard, calibrated_.report.date = "2026-03-01T10:00:00Z";
    Calibration now = calibrated_;
    RigidTransform& motion = now.cameras[0].projector_from_camera;
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(kTurnRad, Eigen::Vector3d(0.6, 0.8, 0)).toRotationMatrix();
    motion = {turn * motion.rotation, turn * motion.translation};
    show(now, kSimulatedBoard);
    std::ofstream(home_ / "calibration.yml") << write_calibration(calibrated_);
    request_.configuration_file = home_ / "slsd.toml";
    request_.from = home_ / "captures";
  }
  void TearDown() override { std::filesystem::remove_all(home_); }

  void show(const Calibration& rig, const char* board, int pose = 1) {
    PatternOptions options;
    options.projector_width_px = 640, options.projector_height_px = 400;
    write_simulated_pose(home_ / "captures/pose_00", rig, *parse_board(board), *make_pattern(options),
                         simulated_pose(pose));
  }
  Result<> verify() {
    request_.correct = false;
    return verify_from_files(request_);
  }
  Result<> correct() {
    request_.correct = true;
    return verify_from_files(request_);
  }
  [[nodiscard]] std::string text_of(const char* file) const {
    std::stringstream text;
    text << std::ifstream(home_ / file).rdbuf();
    return text.str();
  }
  /// The message of a correction that changes nothing.
  std::string refusal() {
    const auto done = correct();
    EXPECT_EQ(text_of("calibration.yml"), write_calibration(calibrated_));
    EXPECT_FALSE(std::filesystem::exists(home_ / "calibration.yml.uncorrected"));
    return done ? "corrected" : to_string(done.error());
  }

  path home_;
  Calibration calibrated_ = small_rig();
  CalibrateRequest request_;
};

TEST_F(CorrectFromFiles, RepairsWhatVerifyFoundAndCanBeUndone) {
  const auto knocked = verify();
  ASSERT_FALSE(knocked);
  EXPECT_THAT(knocked.error().message, HasSubstr("slsd --correct: the projector turned by 0.1"));
  EXPECT_EQ(text_of("calibration.yml"), write_calibration(calibrated_)) << "an offer changes nothing";

  const auto done = correct();
  ASSERT_TRUE(done) << to_string(done.error());
  EXPECT_EQ(text_of("calibration.yml.uncorrected"), write_calibration(calibrated_));
  const auto kept = read_calibration(text_of("calibration.yml"), "calibration.yml");
  ASSERT_TRUE(kept) << to_string(kept.error());
  EXPECT_THAT(*kept->report.corrected, HasSubstr("the projector turned by 0.1"));
  EXPECT_EQ(kept->report.date, calibrated_.report.date);
  const auto repaired = verify();
  EXPECT_TRUE(repaired) << to_string(repaired.error());

  const auto again = correct();
  ASSERT_TRUE(again) << to_string(again.error());
  EXPECT_EQ(text_of("calibration.yml"), write_calibration(*kept)) << "holds now";

  const auto undone = undo_correction(request_.configuration_file);
  ASSERT_TRUE(undone) << to_string(undone.error());
  EXPECT_EQ(text_of("calibration.yml"), write_calibration(calibrated_));
  EXPECT_FALSE(std::filesystem::exists(home_ / "calibration.yml.uncorrected"));
  const auto twice = undo_correction(request_.configuration_file);
  ASSERT_FALSE(twice);
  EXPECT_THAT(to_string(twice.error()), HasSubstr("nothing to undo"));
}

TEST_F(CorrectFromFiles, UndoesOnlyTheCalibrationThatWasCorrected) {
  ASSERT_TRUE(correct());
  Calibration other = calibrated_;
  other.report.date = "2025-01-01T10:00:00Z";
  std::ofstream(home_ / "calibration.yml.uncorrected") << write_calibration(other);
  const std::string before = text_of("calibration.yml");
  const auto undone = undo_correction(request_.configuration_file);
  ASSERT_FALSE(undone);
  EXPECT_EQ(undone.error().code, ErrorCode::kMismatch);
  EXPECT_EQ(text_of("calibration.yml"), before);
}

TEST_F(CorrectFromFiles, KeepsTheFirstCalibrationOverSeveralCorrections) {
  ASSERT_TRUE(correct());
  Calibration now = calibrated_;
  now.cameras[0].projector_from_camera.rotation =
      Eigen::AngleAxisd(-kTurnRad, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
      now.cameras[0].projector_from_camera.rotation;
  show(now, kSimulatedBoard);
  const auto second = correct();
  ASSERT_TRUE(second) << to_string(second.error());
  EXPECT_EQ(text_of("calibration.yml.uncorrected"), write_calibration(calibrated_));
  EXPECT_TRUE(verify());
}

TEST_F(CorrectFromFiles, RefusesAnotherBoard) {
  show(calibrated_, "charuco:7x5:60:45:DICT_6X6_100");
  EXPECT_THAT(refusal(), HasSubstr("pose_00"));
  show(calibrated_, "charuco:7x5:58:43.5:DICT_5X5_100");
  EXPECT_THAT(refusal(), AllOf(HasSubstr("another print"), HasSubstr("Nothing was changed")));
}

TEST_F(CorrectFromFiles, RefusesABoardHalfOutOfView) {
  // Eight columns as large again reach far beyond the picture.
  request_.board = "charuco:14x10:60:45:DICT_5X5_1000";
  calibrated_.report.board = request_.board;
  std::ofstream(home_ / "calibration.yml") << write_calibration(calibrated_);
  show(calibrated_, "charuco:14x10:60:45:DICT_5X5_1000");
  EXPECT_THAT(refusal(), HasSubstr("points are in view: show the whole board"));
}

TEST_F(CorrectFromFiles, NeedsTheWhitePicture) {
  std::filesystem::remove(home_ / "captures/pose_00/white.png");
  EXPECT_THAT(refusal(), HasSubstr("pose_00: has no white.png"));
}

}  // namespace
}  // namespace slsd
