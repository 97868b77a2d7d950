// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include "core/calibration_file/calibration_file.hpp"
#include "drivers/files/encode_png.hpp"
#include "drivers/files/file.hpp"
#include "drivers/files/read_image.hpp"
#include "programs/calibrate/calibrate_from_files.hpp"
#include "tests/programs/calibrate/simulated_captures.hpp"

namespace slsd {
namespace {

using std::filesystem::path;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

constexpr char kPlane[] = "plane:6x4:70:35:DICT_4X4_50";
constexpr int kPoses = 7, kPlanes = 2;

path new_folder() {
  std::string name = testing::TempDir() + "slsd-calibrate-XXXXXX";
  if (mkdtemp(name.data()) == nullptr) std::abort();
  return name;
}

void write_text(const path& file, const std::string& text) {
  std::ofstream(file) << text;
}

std::string configuration_text(int seed = 1, int width_px = 640) {
  return "[pattern]\nseed = " + std::to_string(seed) +
         "\n[projector]\ndriver = \"headless\"\nwidth_px = " + std::to_string(width_px) +
         "\nheight_px = 400\n[calibration]\nfile = \"calibration.yml\"\n";
}

/// Captures that all tests read: drawing them takes seconds.
class FromFiles : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    captures_ = new_folder();
    PatternOptions options;
    options.projector_width_px = 640, options.projector_height_px = 400;
    const auto pattern = make_pattern(options);
    const auto board = parse_board(kSimulatedBoard);
    const auto plane = parse_board(kPlane);
    if (!pattern || !board || !plane) std::abort();
    for (int i = 0; i < kPoses; ++i) {
      write_simulated_pose(captures_ / ("pose_0" + std::to_string(i)), small_rig(), *board, *pattern,
                           simulated_pose(i));
    }
    planes_ = new_folder();
    for (int i = 0; i < kPlanes; ++i) {
      write_simulated_pose(planes_ / ("plane_0" + std::to_string(i)), small_rig(), *plane, *pattern,
                           simulated_pose(3 * i));
    }
  }
  static void TearDownTestSuite() {
    std::filesystem::remove_all(captures_);
    std::filesystem::remove_all(planes_);
  }
  void SetUp() override {
    home_ = new_folder();
    write_text(home_ / "slsd.toml", configuration_text());
    request_.configuration_file = home_ / "slsd.toml";
    request_.from = captures_;
    request_.board = kSimulatedBoard;
  }
  void TearDown() override { std::filesystem::remove_all(home_); }

  /// A copy of the captures, to be spoilt.
  void copy_captures() {
    request_.from = home_ / "captures";
    std::filesystem::copy(captures_, request_.from, std::filesystem::copy_options::recursive);
  }
  /// Poses and views of the plane.
  void copy_all() {
    copy_captures();
    std::filesystem::copy(planes_, request_.from, std::filesystem::copy_options::recursive);
  }
  Calibration kept() {
    const auto text = read_file(home_ / "calibration.yml", 1 << 20);
    return read_calibration(text ? *text : "", "calibration.yml").value_or(Calibration{});
  }
  /// The calibration in force and the one before it survive a failure, to the last byte.
  std::string refusal() {
    const path in_force = home_ / "calibration.yml", before = home_ / "calibration.yml.old";
    if (!std::filesystem::exists(in_force)) write_text(in_force, "what is in force");
    const std::string bytes = *read_file(in_force, 1 << 20);
    write_text(before, "what was before it");
    const auto done = calibrate_from_files(request_);
    EXPECT_FALSE(done);
    EXPECT_EQ(*read_file(in_force, 1 << 20), bytes);
    EXPECT_EQ(*read_file(before, 1 << 20), "what was before it");
    return done ? std::string() : to_string(done.error());
  }

  static path captures_, planes_;
  path home_;
  CalibrateRequest request_;
};
path FromFiles::captures_, FromFiles::planes_;

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

TEST_F(FromFiles, KeepsTheCalibrationBeforeBesideIt) {
  write_text(home_ / "calibration.yml", "what was there");
  ASSERT_TRUE(calibrate_from_files(request_));
  EXPECT_EQ(*read_file(home_ / "calibration.yml.old", 100), "what was there");
  EXPECT_NE(*read_file(home_ / "calibration.yml", 1 << 20), "what was there");
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

// A print that is larger than it is said to be is seen by the calibration in force alone.
TEST_F(FromFiles, ReplacesNoCalibrationOfAnotherScaleUnlessForced) {
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
TEST_F(FromFiles, ReplacesTheCalibrationOfARigThatHasChanged) {
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
TEST_F(FromFiles, WritesAReportOfASessionThatIsRefused) {
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

/// The board as a camera for colour alone sees it, which stands 100 mm beside the other and is coarser.
class FromFilesWithColour : public FromFiles {
 protected:
  static constexpr double kBesideMm = 100;
  static Lens colour_lens() {
    Lens lens = small_rig().cameras[0].lens;
    lens.width_px = 600, lens.height_px = 450;
    lens.fx *= 0.7, lens.fy *= 0.7, lens.cx = 299.5, lens.cy = 224.5;
    return lens;
  }
  static void SetUpTestSuite() {
    FromFiles::SetUpTestSuite();
    colour_ = new_folder();
    PatternOptions options;
    options.projector_width_px = 640, options.projector_height_px = 400;
    Calibration rig = small_rig();
    RigidTransform colour_from_camera;
    colour_from_camera.translation.x() = -kBesideMm;
    rig.cameras[0].lens = colour_lens();
    rig.cameras[0].projector_from_camera = rig.cameras[0].projector_from_camera.after(colour_from_camera.inverse());
    for (int i = 0; i < kPoses; ++i) {
      write_simulated_pose(colour_ / ("pose_0" + std::to_string(i)), rig, *parse_board(kSimulatedBoard),
                           *make_pattern(options), colour_from_camera.after(simulated_pose(i)));
    }
  }
  static void TearDownTestSuite() {
    FromFiles::TearDownTestSuite();
    std::filesystem::remove_all(colour_);
  }
  void SetUp() override {
    FromFiles::SetUp();
    write_text(home_ / "slsd.toml", configuration_text() +
                                        "[[camera]]\nname = \"colour\"\npath = \"colour.png\"\nuse = \"texture\"\n"
                                        "[[camera]]\nname = \"measure\"\npath = \"measure.png\"\n");
    request_.from = home_ / "captures";
    for (const auto& pose : std::filesystem::directory_iterator(captures_)) {
      const path name = pose.path().filename(), to = request_.from / name;
      std::filesystem::create_directories(to);
      std::filesystem::copy(pose.path(), to / "measure");
      std::filesystem::copy(colour_ / name, to / "colour");
    }
  }
  static path colour_;
};
path FromFilesWithColour::colour_;

/// Also if it stands first in the file: the first of the others gives the rig's frame.
TEST_F(FromFilesWithColour, CalibratesItAfterTheOthers) {
  const auto done = calibrate_from_files(request_);
  ASSERT_TRUE(done) << to_string(done.error());
  const Calibration found = kept();
  ASSERT_EQ(found.cameras.size(), 2U);
  EXPECT_EQ(found.cameras[0].name, "measure");
  EXPECT_EQ(found.cameras[0].rig_from_camera.translation.norm(), 0);
  const CalibratedCamera& colour = found.cameras[1];
  EXPECT_EQ(colour.name, "colour");
  EXPECT_EQ(colour.lens.width_px, colour_lens().width_px);
  EXPECT_NEAR(colour.lens.fx / colour_lens().fx, 1, 0.003);
  EXPECT_NEAR(colour.rig_from_camera.translation.x(), kBesideMm, 0.5);
  EXPECT_LT(Eigen::AngleAxisd(colour.rig_from_camera.rotation).angle() * 57.3, 0.15);
}

TEST_F(FromFilesWithColour, NeedsItsPictures) {
  request_.from = captures_;
  const std::string told = refusal();
  EXPECT_THAT(told, HasSubstr("has no pictures of camera \"colour\", and slsd starts only if"));
  EXPECT_THAT(told, HasSubstr("remove its [[camera]] table, or write the calibration elsewhere with --output"));
  request_.output = home_ / "elsewhere.yml";
  const auto done = calibrate_from_files(request_);
  EXPECT_TRUE(done) << to_string(done.error());
}

/// Its pictures have a third of the light in place of the pattern: each shows its own print.
TEST_F(FromFilesWithColour, CostsNoPoseIfItReadsNothing) {
  for (const auto& pose : std::filesystem::directory_iterator(request_.from)) {
    auto seen = read_image(pose.path() / "colour/white.png");
    ASSERT_TRUE(seen) << to_string(seen.error());
    auto& dim = std::get<Grey8>(*seen);
    std::transform(dim.data(), dim.data() + dim.size(), dim.data(),
                   [](std::uint8_t level) { return static_cast<std::uint8_t>(level / 3); });
    ASSERT_TRUE(write_file_atomically(pose.path() / "colour/pattern.png", *encode_png(dim)));
  }
  testing::internal::CaptureStdout();
  const std::string told = refusal(), said = testing::internal::GetCapturedStdout();
  EXPECT_THAT(told, HasSubstr("camera colour: only 0 of the poses can be used, but at least 3 are needed"));
  EXPECT_THAT(said, HasSubstr("pose_00 colour: not used: the board shows nothing of the projected pattern"));
  EXPECT_THAT(said, Not(ContainsRegex("pose_0.: not used")));
}

TEST_F(FromFilesWithColour, NeedsThreePosesThatItSees) {
  for (const char* pose : {"pose_00", "pose_02", "pose_04", "pose_05", "pose_06"})
    std::filesystem::remove_all(request_.from / pose / "colour");
  EXPECT_THAT(refusal(), HasSubstr("camera colour: only 2 of the poses can be used, but at least 3 are needed"));
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

TEST_F(FromFiles, KeepsNothingWhereTheReportCannotBeWritten) {
  std::filesystem::create_directories(home_ / "calibration.html/in the way");
  EXPECT_THAT(refusal(), HasSubstr("calibration.html"));
}

TEST_F(FromFiles, SaysWhatCannotBeWrittenBeforeItBegins) {
  testing::internal::CaptureStdout();
  request_.output = home_;
  EXPECT_THAT(refusal(), HasSubstr("is a folder; name a file in it; slsd has not started to calibrate"));
  request_.output = home_ / "none/calibration.yml";
  EXPECT_THAT(refusal(), HasSubstr("slsd has not started to calibrate"));
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
}

TEST_F(FromFiles, RefusesTheReportsOwnPlace) {
  request_.output = home_ / "result.html";
  EXPECT_THAT(refusal(), HasSubstr("result.html: would be overwritten by the report"));
  EXPECT_FALSE(std::filesystem::exists(request_.output));
}

// The working range lies where neither device sees anything: bad for certain.
TEST_F(FromFiles, PutsNoBadCalibrationInForceUnlessAskedTo) {
  write_text(home_ / "slsd.toml", configuration_text() + "[decode]\ndepth_min_mm = 20.0\ndepth_max_mm = 40.0\n");
  EXPECT_THAT(refusal(), HasSubstr("the calibration is bad and was not put in force"));
  request_.output = home_ / "calibration.yml";
  const auto done = calibrate_from_files(request_);
  ASSERT_TRUE(done) << to_string(done.error());
  EXPECT_EQ(kept().report.verdict, "bad");
  EXPECT_EQ(*read_file(home_ / "calibration.yml.old", 100), "what is in force");
}

TEST_F(FromFiles, ReplacesABetterCalibrationOnlyIfAskedTo) {
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
TEST_F(FromFiles, ReplacesABetterCalibrationOfOtherDevices) {
  Calibration other = small_rig();
  other.cameras[0].name = "camera", other.report.verdict = "good";
  other.projector.width_px = 1280;
  write_text(home_ / "calibration.yml", write_calibration(other));
  const auto done = calibrate_from_files(request_);
  ASSERT_TRUE(done) << to_string(done.error());
  EXPECT_EQ(kept().projector.width_px, 640);
}

// A calibration beside the one that is in force would never be used.
TEST_F(FromFiles, ReplacesTheCalibrationThatWasSetOverTheSocket) {
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

TEST_F(FromFiles, NeedsAPlaceToKeepIt) {
  write_text(home_ / "slsd.toml", "[projector]\nwidth_px = 640\nheight_px = 400\n");
  EXPECT_THAT(refusal(), HasSubstr("no place to save the calibration"));
}

}  // namespace
}  // namespace slsd
