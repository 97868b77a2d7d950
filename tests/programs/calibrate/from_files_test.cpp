// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <cmath>
#include <fstream>

#include <gmock/gmock.h>

#include "drivers/files/encode_png.hpp"
#include "drivers/files/read_image.hpp"
#include "tests/programs/calibrate/from_files.hpp"

namespace slsd {
namespace {

using std::filesystem::path;
using test::FromFiles, test::configuration_text, test::write_text, test::kPlane, test::kPoses;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

TEST_F(FromFiles, KeepsACalibrationNearTheTruth) {
  const auto done = calibrate_from_files(request_);
  ASSERT_TRUE(done) << to_string(done.error());
  const auto text = read_file(home_ / "calibration.yml", 1 << 20);
  ASSERT_TRUE(text);
  const auto found = read_calibration(*text, "calibration.yml");
  ASSERT_TRUE(found) << found.error().message;
  const Calibration truth = small_rig();
  EXPECT_NEAR(found->projector.fx / truth.projector.fx, 1, 0.003);
  EXPECT_NEAR(found->cameras[0].lens.fx / truth.cameras[0].lens.fx, 1, 0.003);
  const RigidTransform &rig = found->cameras[0].projector_from_camera, &is = truth.cameras[0].projector_from_camera;
  EXPECT_LT(Eigen::AngleAxisd(rig.rotation * is.rotation.transpose()).angle() * 57.3, 0.15);
  EXPECT_NEAR(rig.translation.norm(), is.translation.norm(), 1);
  EXPECT_EQ(found->report.board, kSimulatedBoard);
  EXPECT_LT(*found->report.reprojection_error_camera_px, 0.1);
  EXPECT_LT(*found->report.reprojection_error_projector_px, 0.15);
}

TEST_F(FromFiles, TakesThePrintAsItsRulerWasMeasured) {
  request_.ruler = "200:210";
  ASSERT_TRUE(calibrate_from_files(request_));
  const auto found = read_calibration(*read_file(home_ / "calibration.yml", 1 << 20), "");
  const double baseline = small_rig().cameras[0].projector_from_camera.translation.norm();
  EXPECT_NEAR(found->cameras[0].projector_from_camera.translation.norm(), 1.05 * baseline, 1);
}

TEST_F(FromFiles, GoesOnWithTheReferencePlane) {
  copy_all();
  request_.plane = kPlane;
  testing::internal::CaptureStdout();
  const auto done = calibrate_from_files(request_);
  const std::string said = testing::internal::GetCapturedStdout();
  ASSERT_TRUE(done) << to_string(done.error());
  EXPECT_THAT(said, HasSubstr("reference plane " + std::string(kPlane)));
  EXPECT_THAT(said, ContainsRegex("plane_01   before: [0-9.]+ mm off it"));
  EXPECT_THAT(said, ContainsRegex("after it: [0-9.]+ % of the distance off it"));
  EXPECT_THAT(said, Not(HasSubstr("warning")));
  const Calibration truth = small_rig();
  EXPECT_NEAR(kept().projector.fx / truth.projector.fx, 1, 0.003);
  const double baseline = truth.cameras[0].projector_from_camera.translation.norm();
  EXPECT_NEAR(kept().cameras.at(0).projector_from_camera.translation.norm(), baseline, 1);
  EXPECT_THAT(*read_file(home_ / "calibration.html", 1 << 24), HasSubstr("<td>plane_00 camera</td>"));
}

TEST_F(FromFiles, SaysThatThePlaneIsOfAnotherScale) {
  copy_all();
  for (const char* pose : {"pose_05", "pose_06"}) std::filesystem::remove_all(request_.from / pose);
  request_.plane = kPlane;
  request_.plane_ruler = "200:204";
  testing::internal::CaptureStdout();
  const auto done = calibrate_from_files(request_);
  const std::string said = testing::internal::GetCapturedStdout();
  ASSERT_TRUE(done) << to_string(done.error());
  EXPECT_THAT(said, HasSubstr("warning: the board and the reference plane differ in scale"));
  const double baseline = small_rig().cameras[0].projector_from_camera.translation.norm();
  EXPECT_NEAR(kept().cameras.at(0).projector_from_camera.translation.norm(), 1.02 * baseline, 1);
}

TEST_F(FromFiles, RefusesAPlaneWithoutItsPrintAndAPrintWithoutAPlane) {
  request_.plane = kPlane;
  EXPECT_THAT(refusal(), HasSubstr("has no view of the reference plane for --plane"));
  copy_all();
  request_.plane.clear();
  EXPECT_THAT(refusal(), HasSubstr("plane_00: is a view of a reference plane: name its print with --plane"));
  request_.plane_ruler = "200:201";
  EXPECT_THAT(refusal(), HasSubstr("--plane-ruler: needs --plane"));
}

TEST_F(FromFiles, LeavesAPoseOutThatShowsNothing) {
  copy_captures();
  const auto black = encode_png(Grey8(800, 600, 3));
  ASSERT_TRUE(write_file_atomically(request_.from / "pose_02/white.png", *black));
  EXPECT_TRUE(calibrate_from_files(request_));
}

// It costs that pose alone.
TEST_F(FromFiles, LeavesAPoseOutOfWhichAPictureIsMissing) {
  copy_captures();
  std::filesystem::remove(request_.from / "pose_03/white.png");
  std::filesystem::remove(request_.from / "pose_05/pattern.png");
  testing::internal::CaptureStdout();
  const auto done = calibrate_from_files(request_);
  const std::string said = testing::internal::GetCapturedStdout();
  ASSERT_TRUE(done) << to_string(done.error());
  EXPECT_THAT(said, HasSubstr("pose_03/white.png: is missing"));
  EXPECT_THAT(said, HasSubstr("pose_05: lacks a projected image"));
  EXPECT_THAT(said, HasSubstr("pose_04: 24 corners"));
}

TEST_F(FromFiles, RefusesAFolderThatIsNotThere) {
  request_.from = home_ / "nowhere";
  EXPECT_THAT(refusal(), HasSubstr("nowhere: is not a folder"));
}

TEST_F(FromFiles, LeavesAPoseOutWhosePicturesAreOfTwoSizes) {
  copy_captures();
  ASSERT_TRUE(write_file_atomically(request_.from / "pose_03/pattern.png", *encode_png(Grey8(640, 480))));
  testing::internal::CaptureStdout();
  const auto done = calibrate_from_files(request_);
  const std::string said = testing::internal::GetCapturedStdout();
  ASSERT_TRUE(done) << to_string(done.error());
  EXPECT_THAT(said, HasSubstr("pose_03/pattern.png: has 640x480 pixels, but the pictures before it have 800x600"));
}

// The first pose is no measure for the others, and what is not seen in the smaller pictures is not what is wrong.
TEST_F(FromFiles, LeavesPosesOutThatAreOfAnotherSizeThanTheOthers) {
  copy_captures();
  const auto cut_to = [&](const path& pose, int width) {
    for (const char* picture : {"white.png", "pattern.png"}) {
      const Grey8 whole = std::get<Grey8>(*read_image(request_.from / pose / picture));
      Grey8 cut(width, whole.height());
      for (int y = 0; y < cut.height(); ++y) std::copy_n(whole.row(y), cut.width(), cut.row(y));
      ASSERT_TRUE(write_file_atomically(request_.from / pose / picture, *encode_png(cut)));
    }
  };
  cut_to("pose_00", 760), cut_to("pose_03", 80);
  testing::internal::CaptureStdout();
  const auto done = calibrate_from_files(request_);
  const std::string said = testing::internal::GetCapturedStdout();
  ASSERT_TRUE(done) << to_string(done.error());
  EXPECT_THAT(
      said,
      HasSubstr("pose_00: not used: its pictures have 760x600 pixels, but those of the other poses have 800x600"));
  EXPECT_THAT(
      said, HasSubstr("pose_03: not used: its pictures have 80x600 pixels, but those of the other poses have 800x600"));
  EXPECT_THAT(said, ContainsRegex("pose_03 +left out: its pictures have 80x600 pixels"));
  EXPECT_EQ(kept().cameras.at(0).lens.width_px, 800);
}

TEST_F(FromFiles, NamesAPoseClippedWhosePatternIsLostInTheLight) {
  copy_captures();
  const path white = request_.from / "pose_03/white.png";
  Grey8 picture = std::get<Grey8>(*read_image(white));
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      picture.row(y)[x] = static_cast<std::uint8_t>(std::min(255, 3 * picture.row(y)[x]));
    }
  }
  for (const path& file : {white, request_.from / "pose_03/pattern.png"}) {
    ASSERT_TRUE(write_file_atomically(file, *encode_png(picture)));
  }
  testing::internal::CaptureStdout();
  const auto done = calibrate_from_files(request_);
  const std::string said = testing::internal::GetCapturedStdout();
  ASSERT_TRUE(done) << to_string(done.error());
  EXPECT_THAT(said, ContainsRegex("pose_03 +left out: clipped: [0-9]+ % of the board's pixels are at full level"));
}

TEST_F(FromFiles, NamesPatternsThatWereSwapped) {
  copy_captures();
  const path one = request_.from / "pose_02/pattern.png", other = request_.from / "pose_04/pattern.png";
  std::filesystem::rename(one, home_ / "kept.png");
  std::filesystem::rename(other, one);
  std::filesystem::rename(home_ / "kept.png", other);
  testing::internal::CaptureStdout();
  const auto done = calibrate_from_files(request_);
  const std::string said = testing::internal::GetCapturedStdout();
  ASSERT_TRUE(done) << to_string(done.error());
  EXPECT_THAT(
      said,
      HasSubstr(
          "pose_02: not used: its pattern picture belongs to another pose, and pose_04 has the one of this pose"));
  EXPECT_THAT(said, HasSubstr("pose_04: not used: its pattern picture belongs to another pose"));
}

TEST_F(FromFiles, NamesAPatternThatWasCopied) {
  copy_captures();
  std::filesystem::copy_file(request_.from / "pose_02/pattern.png", request_.from / "pose_04/pattern.png",
                             std::filesystem::copy_options::overwrite_existing);
  testing::internal::CaptureStdout();
  const auto done = calibrate_from_files(request_);
  const std::string said = testing::internal::GetCapturedStdout();
  ASSERT_TRUE(done) << to_string(done.error());
  EXPECT_THAT(said, HasSubstr("pose_04: not used: its pattern picture copies that of pose_02"));
  EXPECT_THAT(said, Not(HasSubstr("pose_02: not used")));
}

TEST_F(FromFiles, NamesAPatternThatIsShifted) {
  copy_captures();
  const path file = request_.from / "pose_02/pattern.png";
  Grey8 picture = std::get<Grey8>(*read_image(file));
  for (int y = 0; y < picture.height(); ++y) {
    std::rotate(picture.row(y), picture.row(y) + picture.width() - 9, picture.row(y) + picture.width());
  }
  ASSERT_TRUE(write_file_atomically(file, *encode_png(picture)));
  testing::internal::CaptureStdout();
  const auto done = calibrate_from_files(request_);
  const std::string said = testing::internal::GetCapturedStdout();
  ASSERT_TRUE(done) << to_string(done.error());
  EXPECT_THAT(said,
              HasSubstr("pose_02        left out: the board's print moved by 9 px between the white picture and the "
                        "pattern"));
}

TEST_F(FromFiles, NamesAPatternOfWhichAPartIsCovered) {
  copy_captures();
  const path file = request_.from / "pose_02/pattern.png";
  const Grey8 picture = std::get<Grey8>(*read_image(file));
  constexpr int kLeft = 330, kTop = 230, kWidth = 130, kHeight = 130, kAside = 23;
  const auto told = [&](bool copied) {
    Grey8 spoilt = picture;
    for (int y = kTop; y < kTop + kHeight; ++y)
      for (int x = kLeft; x < kLeft + kWidth; ++x) spoilt.row(y)[x] = copied ? picture.row(y)[x + kAside] : 90;
    EXPECT_TRUE(write_file_atomically(file, *encode_png(spoilt)));
    testing::internal::CaptureStdout();
    const auto done = calibrate_from_files(request_);
    std::string said = testing::internal::GetCapturedStdout();
    EXPECT_TRUE(done) << to_string(done.error());
    return said;
  };
  const std::string hidden = "symbols are missing in one place, although the white picture shows the board there";
  EXPECT_THAT(told(false), HasSubstr(hidden));
  const std::string said = told(true);
  EXPECT_THAT(said, HasSubstr(hidden));
  EXPECT_EQ(said.find(hidden), said.rfind(hidden));  // of that pose alone
}

TEST_F(FromFiles, TakesABoardNamedRowsByColumns) {
  request_.board = "charuco:5x7:60:45:DICT_5X5_100";
  testing::internal::CaptureStdout();
  const auto done = calibrate_from_files(request_);
  const std::string said = testing::internal::GetCapturedStdout();
  ASSERT_TRUE(done) << to_string(done.error());
  EXPECT_THAT(said,
              HasSubstr("the board is " + std::string(kSimulatedBoard) + ": --board had its columns and rows swapped"));
  EXPECT_EQ(kept().report.board, kSimulatedBoard);
}

TEST_F(FromFiles, UsesThePosesOfOnePart) {
  request_.use = "pose_01:pose_04";
  testing::internal::CaptureStdout();
  const auto done = calibrate_from_files(request_);
  const std::string said = testing::internal::GetCapturedStdout();
  ASSERT_TRUE(done) << to_string(done.error());
  EXPECT_THAT(said, HasSubstr("400, 4 poses"));
  EXPECT_THAT(said, Not(HasSubstr("pose_05")));
  request_.use = "pose_01:pose_09";
  EXPECT_THAT(refusal(), HasSubstr("--use pose_01:pose_09: matches no pose"));
}

// As cameras write .JPG.
TEST_F(FromFiles, TakesExtensionsInCapitals) {
  copy_captures();
  for (const char* picture : {"white", "pattern"}) {
    const path file = request_.from / "pose_03" / picture;
    std::filesystem::rename(file.string() + ".png", file.string() + ".PNG");
  }
  testing::internal::CaptureStdout();
  const auto done = calibrate_from_files(request_);
  const std::string said = testing::internal::GetCapturedStdout();
  ASSERT_TRUE(done) << to_string(done.error());
  EXPECT_THAT(said, ContainsRegex("pose_03: [0-9]+ corners"));
}

TEST_F(FromFiles, RefusesAnotherBoard) {
  request_.board = "charuco:7x5:60:45:DICT_4X4_50";
  EXPECT_THAT(refusal(), testing::AllOf(HasSubstr("no pose is usable"), HasSubstr("give the board that was printed")));
}

TEST_F(FromFiles, RefusesAnotherPattern) {
  write_text(home_ / "slsd.toml", configuration_text(77));
  EXPECT_THAT(refusal(), HasSubstr("not those of the configured pattern"));
}

TEST_F(FromFiles, RefusesOnePose) {
  copy_captures();
  for (int i = 1; i < kPoses; ++i) std::filesystem::remove_all(request_.from / ("pose_0" + std::to_string(i)));
  EXPECT_THAT(refusal(), HasSubstr("1 of the poses can be used, but at least 3 are needed"));
}

}  // namespace
}  // namespace slsd
