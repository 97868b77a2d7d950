// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// Rendered boards and a file of poses, through the whole command.
#include "programs/hand_eye/hand_eye_from_files.hpp"
#include "core/calibration_file/calibration_file.hpp"
#include "core/calibration_file/hand_eye_file.hpp"

#include <cstdlib>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include "core/geometry/robot_pose.hpp"
#include "drivers/files/file.hpp"
#include "tests/programs/calibrate/simulated_captures.hpp"

namespace slsd {
namespace {

using std::filesystem::path;
using testing::HasSubstr;
using testing::Not;

constexpr int kViews = 8;

path temporary_folder() {
  std::string name = testing::TempDir() + "slsd-hand-eye-XXXXXX";
  if (mkdtemp(name.data()) == nullptr) std::abort();
  return name;
}

/// A scanner on an arm, and a board in the cell. Drawing the captures takes seconds, so all tests share them.
class HandEyeFromFiles : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    home_ = temporary_folder();
    PatternOptions options;
    options.projector_width_px = 640, options.projector_height_px = 400;
    Calibration calibration = small_rig();
    calibration.report.board = kSimulatedBoard;
    std::ofstream(home_ / "calibration.yml") << write_calibration(calibration);
    std::ofstream(home_ / "slsd.toml") << "[projector]\nwidth_px = 640\nheight_px = 400\n"
                                          "[calibration]\nfile = \"calibration.yml\"\n";
    for (int i = 0; i < kViews; ++i) {
      write_simulated_pose(home_ / fmt::format("captures/pose_{:02}", i), small_rig(), *parse_board(kSimulatedBoard),
                           *make_pattern(options), simulated_pose(i));
    }
  }
  static void TearDownTestSuite() { std::filesystem::remove_all(home_); }
  void SetUp() override {
    write_poses("kuka", 1);
    request_.configuration_file = home_ / "slsd.toml";
    request_.mounted = "arm", request_.poses = "kuka";
    request_.from = home_ / "captures";
    request_.output = home_ / "hand_eye.yml";
    std::filesystem::remove(request_.output);
  }

  static RigidTransform flange_from_rig() {
    return {Eigen::AngleAxisd(0.7, Eigen::Vector3d(0.2, -0.1, 1).normalized()).toRotationMatrix(), {60, -35, 110}};
  }

  /// @param unit  of lengths, in the notation's
  static void write_poses(const char* notation, double unit) {
    const RigidTransform base_from_board{
        Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, 0.3, -0.2).normalized()).toRotationMatrix(), {900, 200, 50}};
    std::ofstream file(home_ / "captures/poses.csv");
    file << "# written by the test\n";
    for (int i = 0; i < kViews; ++i) {
      const RigidTransform base_from_flange =
          base_from_board.after(simulated_pose(i).inverse()).after(flange_from_rig().inverse());
      file << fmt::format("pose_{:02}", i);
      std::vector<double> numbers = robot_numbers(base_from_flange, *pose_notation(notation));
      for (std::size_t k = 0; k < numbers.size(); ++k) file << fmt::format(",{:.6f}", numbers[k] * (k < 3 ? unit : 1));
      file << "\n";
    }
  }

  static inline path home_;
  HandEyeRequest request_;
};

TEST_F(HandEyeFromFiles, PlacesTheScannerOnTheFlange) {
  const auto done = hand_eye_from_files(request_);
  ASSERT_TRUE(done) << to_string(done.error());
  const auto text = read_file(request_.output, 1 << 20);
  ASSERT_TRUE(text);
  const auto read = read_hand_eye(*text, "hand_eye.yml");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->mounted, Mounted::kArm);
  EXPECT_LT((read->mount_from_rig.translation - flange_from_rig().translation).norm(), 1.5);
  EXPECT_LT(Eigen::AngleAxisd(read->mount_from_rig.rotation.transpose() * flange_from_rig().rotation).angle(), 1e-3);
  for (const char* key : {"covariance:", "verdict:", "error_mm:", "distance_mm:", "board:", "date:"})
    EXPECT_THAT(*text, HasSubstr(key));
}

TEST_F(HandEyeFromFiles, NamesAFaultAndWritesNothing) {
  write_poses("kuka", 0.001);
  const auto done = hand_eye_from_files(request_);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().code, ErrorCode::kMismatch);
  EXPECT_THAT(done.error().message, HasSubstr("the poses are in m, not in mm"));
  EXPECT_FALSE(std::filesystem::exists(request_.output));
}

TEST_F(HandEyeFromFiles, RefusesTooFewPoses) {
  request_.without = {"pose_00", "pose_01", "pose_02", "pose_03", "pose_04", "pose_05"};
  const auto done = hand_eye_from_files(request_);
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error().message, HasSubstr("2 poses are too few"));
  request_.without = {"pose_99"};
  const auto unknown = hand_eye_from_files(request_);
  ASSERT_FALSE(unknown);
  EXPECT_THAT(to_string(unknown.error()), HasSubstr("--without pose_99: matches no line"));
}

TEST_F(HandEyeFromFiles, RefusesAPoseWithoutACapture) {
  std::ofstream(home_ / "captures/poses.csv", std::ios::app) << "pose_42,1,2,3,4,5,6\n";
  const auto done = hand_eye_from_files(request_);
  ASSERT_FALSE(done);
  EXPECT_THAT(to_string(done.error()), HasSubstr("pose_42: poses.csv names it"));
  std::filesystem::remove(home_ / "captures/poses.csv");
  EXPECT_FALSE(hand_eye_from_files(request_));
}

TEST_F(HandEyeFromFiles, NamesCapturesWithoutAPose) {
  const auto file = home_ / "captures/poses.csv";
  std::string text = *read_file(file, 1 << 20);
  text.erase(text.find("pose_07"));
  std::ofstream(file) << text;
  request_.without = {"pose_06"};
  testing::internal::CaptureStderr();
  const auto done = hand_eye_from_files(request_);
  const std::string words = testing::internal::GetCapturedStderr();
  EXPECT_TRUE(done) << to_string(done.error());
  EXPECT_THAT(words, HasSubstr("pose_07: not used: poses.csv has no line of this name"));
  EXPECT_THAT(words, Not(HasSubstr("pose_06")));
}

TEST(HandEyeFile, RefusesWhatIsNoPlace) {
  HandEyeCalibration kept;
  kept.mounted = Mounted::kCell, kept.verdict = "good", kept.board = kSimulatedBoard, kept.date = "today";
  const std::string text = write_hand_eye(kept);
  EXPECT_TRUE(read_hand_eye(text, "file"));
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string changed = text;
    changed.replace(changed.find(from), from.size(), to);
    const auto read = read_hand_eye(changed, "file");
    return read ? std::string("no error") : to_string(read.error());
  };
  EXPECT_THAT(with("\"cell\"", "\"desk\""), HasSubstr("mounted"));
  EXPECT_THAT(with("base_from_rig_R", "base_from_rig_Q"), HasSubstr("base_from_rig_R"));
  EXPECT_THAT(with("[ 1.", "[ 2."), HasSubstr("is not a rotation"));
}

}  // namespace
}  // namespace slsd
