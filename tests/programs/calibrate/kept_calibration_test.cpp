// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <fstream>

#include <gmock/gmock.h>

#include "tests/programs/calibrate/from_files.hpp"

namespace slsd {
namespace {

using test::FromFiles, test::configuration_text, test::write_text;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

/// The calibration and the report that are in force after a calibration from files.
class KeptCalibration : public FromFiles {};

TEST_F(KeptCalibration, KeepsTheCalibrationBeforeBesideIt) {
  write_text(home_ / "calibration.yml", "what was there");
  ASSERT_TRUE(calibrate_from_files(request_));
  EXPECT_EQ(*read_file(home_ / "calibration.yml.old", 100), "what was there");
  EXPECT_NE(*read_file(home_ / "calibration.yml", 1 << 20), "what was there");
}

// A print that is larger than it is said to be is seen by the calibration in force alone.
TEST_F(KeptCalibration, ReplacesNoCalibrationOfAnotherScaleUnlessForced) {
  Calibration truth = small_rig();
  truth.cameras[0].name = "camera";
  write_text(home_ / "calibration.yml", write_calibration(truth));
  request_.board = "charuco:7x5:61.8:46.35:DICT_5X5_100";
  EXPECT_THAT(refusal(), testing::AllOf(ContainsRegex("measures (59\\.9|60\\.[01])"),
                                        HasSubstr("for a board spacing of 61.80 mm"), HasSubstr("--force")));
  request_.force = true;
  const auto done = calibrate_from_files(request_);
  ASSERT_TRUE(done) << to_string(done.error());
  EXPECT_NEAR(kept().cameras[0].projector_from_camera.translation.norm(),
              1.03 * truth.cameras[0].projector_from_camera.translation.norm(), 1);
}

// The calibration in force says nothing of a rig that was knocked since, however good it was.
TEST_F(KeptCalibration, ReplacesTheCalibrationOfARigThatHasChanged) {
  const auto said_of = [&](const Eigen::AngleAxisd& turn) {
    Calibration before = small_rig();
    before.cameras[0].name = "camera", before.report.verdict = "good";
    RigidTransform& place = before.cameras[0].projector_from_camera;
    place = {turn.toRotationMatrix() * place.rotation, turn * place.translation};
    write_text(home_ / "calibration.yml", write_calibration(before));
    testing::internal::CaptureStdout();
    const auto done = calibrate_from_files(request_);
    EXPECT_TRUE(done) << to_string(done.error());
    EXPECT_NEAR(kept().cameras[0].projector_from_camera.rotation(0, 2),
                small_rig().cameras[0].projector_from_camera.rotation(0, 2), 2e-3);
    return testing::internal::GetCapturedStdout();
  };
  const double degree = 0.0174533;
  EXPECT_THAT(said_of({0.3 * degree, Eigen::Vector3d::UnitY()}),
              ContainsRegex("the rig has changed since the calibration in force: .* turned by 0\\.[23][0-9] degrees"));
  EXPECT_THAT(said_of({2 * degree, Eigen::Vector3d::UnitY()}), ContainsRegex("turned by (2\\.0|1\\.9)[0-9] degrees"));
  EXPECT_THAT(said_of({3.14159, Eigen::Vector3d::UnitZ()}), HasSubstr("upside down"));
}

// Beside the report of the calibration in force, which stays.
TEST_F(KeptCalibration, WritesAReportOfASessionThatIsRefused) {
  write_text(home_ / "calibration.html", "the report in force");
  write_text(home_ / "slsd.toml", configuration_text() + "[decode]\ndepth_min_mm = 20.0\ndepth_max_mm = 40.0\n");
  EXPECT_THAT(refusal(), HasSubstr("the calibration is bad"));
  EXPECT_EQ(*read_file(home_ / "calibration.html", 100), "the report in force");
  EXPECT_THAT(*read_file(home_ / "calibration-refused.html", 1 << 20),
              testing::AllOf(HasSubstr("not put in force"), HasSubstr("the calibration is bad"), HasSubstr("<svg")));
  write_text(home_ / "slsd.toml", configuration_text(2));
  EXPECT_THAT(refusal(), HasSubstr("no pose is usable"));
  EXPECT_THAT(*read_file(home_ / "calibration-refused.html", 1 << 20),
              testing::AllOf(HasSubstr("no pose is usable"), HasSubstr("pose_00"), Not(HasSubstr("<svg"))));
}

TEST_F(KeptCalibration, KeepsNothingWhereTheReportCannotBeWritten) {
  std::filesystem::create_directories(home_ / "calibration.html/in the way");
  EXPECT_THAT(refusal(), HasSubstr("calibration.html"));
}

TEST_F(KeptCalibration, SaysWhatCannotBeWrittenBeforeItBegins) {
  testing::internal::CaptureStdout();
  request_.output = home_;
  EXPECT_THAT(refusal(), HasSubstr("is a folder; name a file in it; slsd has not started to calibrate"));
  request_.output = home_ / "none/calibration.yml";
  EXPECT_THAT(refusal(), HasSubstr("slsd has not started to calibrate"));
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
}

TEST_F(KeptCalibration, RefusesTheReportsOwnPlace) {
  request_.output = home_ / "result.html";
  EXPECT_THAT(refusal(), HasSubstr("result.html: would be overwritten by the report"));
  EXPECT_FALSE(std::filesystem::exists(request_.output));
}

// The working range lies where neither device sees anything: bad for certain.
TEST_F(KeptCalibration, PutsNoBadCalibrationInForceUnlessAskedTo) {
  write_text(home_ / "slsd.toml", configuration_text() + "[decode]\ndepth_min_mm = 20.0\ndepth_max_mm = 40.0\n");
  EXPECT_THAT(refusal(), HasSubstr("the calibration is bad and was not put in force"));
  request_.output = home_ / "calibration.yml";
  const auto done = calibrate_from_files(request_);
  ASSERT_TRUE(done) << to_string(done.error());
  EXPECT_EQ(kept().report.verdict, "bad");
  EXPECT_EQ(*read_file(home_ / "calibration.yml.old", 100), "what is in force");
}

TEST_F(KeptCalibration, ReplacesABetterCalibrationOnlyIfAskedTo) {
  Calibration better = small_rig();
  better.cameras[0].name = "camera", better.report.verdict = "good";
  write_text(home_ / "calibration.yml", write_calibration(better));
  EXPECT_THAT(
      refusal(),
      HasSubstr("the calibration is usable, but the one in force is good and of the same rig, so it stays in force"));
  request_.output = home_ / "calibration.yml";
  const auto asked = calibrate_from_files(request_);
  ASSERT_TRUE(asked) << to_string(asked.error());
  EXPECT_EQ(kept().report.verdict, "usable");
  request_.output.clear();
  better.report.verdict = "usable";
  write_text(home_ / "calibration.yml", write_calibration(better));
  EXPECT_TRUE(calibrate_from_files(request_)) << "one that is as good";
}

// That of another projector is of no use, however good.
TEST_F(KeptCalibration, ReplacesABetterCalibrationOfOtherDevices) {
  Calibration other = small_rig();
  other.cameras[0].name = "camera", other.report.verdict = "good";
  other.projector.width_px = 1280;
  write_text(home_ / "calibration.yml", write_calibration(other));
  const auto done = calibrate_from_files(request_);
  ASSERT_TRUE(done) << to_string(done.error());
  EXPECT_EQ(kept().projector.width_px, 640);
}

// A calibration beside the one that is in force would never be used.
TEST_F(KeptCalibration, ReplacesTheCalibrationThatWasSetOverTheSocket) {
  write_text(home_ / "set.yml", write_calibration(small_rig()));
  write_text(home_ / "settings-slsd.json", R"({"calibration": {"file": ")" + (home_ / "set.yml").string() + R"("}})");
  setenv("STATE_DIRECTORY", home_.c_str(), 1);
  testing::internal::CaptureStdout();
  const auto done = calibrate_from_files(request_);
  unsetenv("STATE_DIRECTORY");
  EXPECT_THAT(testing::internal::GetCapturedStdout(), HasSubstr("set over the socket: calibration.file"));
  ASSERT_TRUE(done) << to_string(done.error());
  EXPECT_TRUE(std::filesystem::exists(home_ / "set.yml.old"));
  EXPECT_FALSE(std::filesystem::exists(home_ / "calibration.yml"));
}

TEST_F(KeptCalibration, NeedsAPlaceToKeepIt) {
  write_text(home_ / "slsd.toml", "[projector]\nwidth_px = 640\nheight_px = 400\n");
  EXPECT_THAT(refusal(), HasSubstr("no place to save the calibration"));
}

}  // namespace
}  // namespace slsd
