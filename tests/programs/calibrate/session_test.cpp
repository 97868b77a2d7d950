// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/session/pose_session.hpp"

#include <memory>
#include <sstream>

#include <gmock/gmock.h>

#include "core/calibrate/observe/gray_code.hpp"
#include "drivers/files/file.hpp"
#include "programs/calibrate/captures/capture_folder.hpp"
#include "programs/calibrate/session/session_record.hpp"
#include "tests/drivers/temporary_folder.hpp"
#include "tests/programs/calibrate/board_stage.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::Not;

const std::vector<HeldBoard> kPoses{{{0, 0, 650}, 0, 0}, {{0, 0, 650}, 0, 0.45}, {{60, 30, 680}, -0.4, 0}};

const Pattern& pattern() {
  static const Pattern made = *make_pattern({});
  return made;
}

/// A session on a stage. A person goes on to the next of kPoses as soon as one is taken.
class CalibrationSession : public ::testing::Test {
 protected:
  void begin(std::vector<std::string> cameras = {"left"}, bool gray_code = false) {
    stage_ =
        std::make_unique<BoardStage>(subject_ == PoseSubject::kBoard ? board_ : plane_, projector_, std::move(cameras));
    stage_->operate = [this](const auto&) {
      return std::optional(kPoses.at(std::min(poses_->size(), kPoses.size() - 1)));
    };
    observers_ = std::make_unique<PoseObservers>(make_observers(board_, plane_, pattern(), projector_, gray_code));
    auto record =
        read_record(folder_.path(), stage_->cameras(), projector_, gray_code, *observers_, [](const auto&) {});
    ASSERT_TRUE(record) << to_string(record.error());
    poses_ = std::make_unique<PoseCollection>(subject_ == PoseSubject::kBoard ? board_ : plane_, record->observations,
                                              subject_);
    recorder_ = *PoseRecorder::create(folder_.path(), stage_->cameras(), pattern());
    taker_ = std::make_unique<PoseTaker>(*stage_, observers_->of(subject_),
                                         gray_code ? draw_gray_code(projector_) : std::vector{draw_pattern(pattern())},
                                         gray_code);
  }

  Result<> run(
      std::size_t poses, std::function<bool()> interrupted = [] { return false; }) {
    const Timepiece time = stage_->timepiece();
    SessionTerminal terminal(out_, 0, time.now);
    PoseSessionOptions options = options_;
    options.poses = poses;
    // What goes wrong ends a test too.
    const auto ends = [&] { return interrupted() || stage_->pictures() > 300; };
    return PoseSession({*stage_, *taker_, *recorder_, *poses_, terminal, time, ends}, options).run();
  }

  [[nodiscard]] bool says(const std::string& words) const { return out_.str().find(words) != std::string::npos; }

  Board board_ = *parse_board("charuco:11x7:25:18.75:DICT_5X5_1000");
  const Board plane_ = *parse_board("plane:6x4:45:18:DICT_4X4_50");
  PoseSubject subject_ = PoseSubject::kBoard;  ///< what begin() begins with
  const ImageSize projector_{pattern().options.projector_width_px, pattern().options.projector_height_px};
  test::TemporaryFolder folder_;
  std::unique_ptr<BoardStage> stage_;
  std::unique_ptr<PoseObservers> observers_;
  std::unique_ptr<PoseCollection> poses_;
  std::optional<PoseRecorder> recorder_;
  PoseSessionOptions options_;
  std::unique_ptr<PoseTaker> taker_;
  std::ostringstream out_;
};

TEST_F(CalibrationSession, TakesPosesByItself) {
  begin();
  const auto taken = run(3);
  ASSERT_TRUE(taken) << to_string(taken.error());
  ASSERT_EQ(poses_->size(), 3u) << out_.str();
  for (std::size_t i = 0; i < 3; ++i) {
    const PoseObservation& pose = poses_->observations().poses[i];
    EXPECT_EQ(pose.name, "pose_0" + std::to_string(i));
    ASSERT_EQ(pose.views.size(), 1u);
    EXPECT_GE(pose.views[0].corners.size(), 50u);
    const Eigen::Matrix3d truth = stage_->projector_from_camera(kPoses[i]);
    std::size_t right = 0;
    for (const ProjectedPoint& symbol : pose.views[0].symbols) {
      const Eigen::Vector2d lit = (truth * symbol.camera_px.homogeneous()).hnormalized();
      right += (lit - symbol.projector_px).norm() < 1.5 ? 1 : 0;
    }
    EXPECT_GE(right, 30u);
    EXPECT_GE(right, pose.views[0].symbols.size() * 9 / 10);
  }
  EXPECT_EQ(stage_->coded(), 3);
  EXPECT_THAT(out_.str(), HasSubstr("pose_02: taken"));
  EXPECT_THAT(out_.str(), HasSubstr("all poses are taken"));
  EXPECT_THAT(out_.str(), Not(HasSubstr("not taken")));
}

// What is recorded gives what the session saw, to the last bit.
TEST_F(CalibrationSession, IsRecordedSoThatItCanBeComputedAgain) {
  begin();
  ASSERT_TRUE(run(2));
  ASSERT_EQ(poses_->size(), 2u) << out_.str();
  const Observations seen = poses_->observations();
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / "pattern.toml"));
  begin();
  ASSERT_EQ(poses_->size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const PoseView &then = seen.poses[i].views.at(0), &now = poses_->observations().poses[i].views.at(0);
    EXPECT_EQ(poses_->observations().poses[i].name, seen.poses[i].name);
    ASSERT_EQ(now.corners.size(), then.corners.size());
    EXPECT_EQ(now.corners[7].camera_px, then.corners[7].camera_px);
    EXPECT_EQ(now.symbols.size(), then.symbols.size());
  }
}

TEST_F(CalibrationSession, GoesOnWithWhatIsRecorded) {
  begin();
  ASSERT_TRUE(run(1));
  begin();
  ASSERT_EQ(poses_->size(), 1u) << out_.str();
  ASSERT_TRUE(run(2));
  ASSERT_EQ(poses_->size(), 2u) << out_.str();
  EXPECT_EQ(poses_->observations().poses[1].name, "pose_01");
}

TEST_F(CalibrationSession, TakesTheReferencePlaneAfterThePoses) {
  begin();
  ASSERT_TRUE(run(1));
  subject_ = PoseSubject::kPlane;
  begin();
  ASSERT_EQ(poses_->size(), 0u);
  ASSERT_TRUE(run(2));
  ASSERT_EQ(poses_->size(), 2u) << out_.str();
  EXPECT_EQ(poses_->observations().poses[1].name, "plane_01");
  EXPECT_EQ(poses_->observations().poses[1].subject, PoseSubject::kPlane);
  EXPECT_THAT(out_.str(), HasSubstr("next: hold the reference plane at your nearest"));
  EXPECT_THAT(out_.str(), HasSubstr("plane 1 of 2: "));
  EXPECT_THAT(out_.str(), HasSubstr("1 more; next: hold the reference plane in the middle"));
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / "pose_00" / "white.png"));
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / "plane_01" / "pattern.png"));
  begin();
  EXPECT_EQ(poses_->size(), 2u) << "it goes on with what is recorded";
}

TEST_F(CalibrationSession, RefusesPlanesOfWhichNothingIsKnown) {
  std::filesystem::create_directories(folder_.path() / "pose_00");
  std::filesystem::create_directories(folder_.path() / "plane_00");
  for (const char* file : {"pose_00/white.png", "pose_00/pattern.png", "plane_00/white.png", "plane_00/pattern.png"}) {
    ASSERT_TRUE(write_file_atomically(folder_.path() / file, "a picture"));
  }
  const auto listed = list_captures_with_planes(folder_.path(), false);
  ASSERT_FALSE(listed);
  EXPECT_THAT(to_string(listed.error()),
              HasSubstr("plane_00: is a view of a reference plane: name its print with --plane"));
  EXPECT_EQ(list_captures_with_planes(folder_.path(), true)->size(), 2u);
  EXPECT_EQ(list_captures(folder_.path())->size(), 1u);
}

TEST_F(CalibrationSession, RefusesAPoseLikeAnEarlierOne) {
  begin();
  HeldBoard shifted = kPoses[0];
  shifted.middle_mm.x() += 10;
  stage_->operate = [&](const auto&) { return std::optional(poses_->size() == 0 ? kPoses[0] : shifted); };
  ASSERT_TRUE(run(2, [&] { return says("same as"); }));
  EXPECT_THAT(out_.str(), HasSubstr("not taken: same as pose_00"));
  EXPECT_EQ(poses_->size(), 1u);
}

// It stands where a pose was taken: nothing is to be said until it moves.
TEST_F(CalibrationSession, LeavesABoardThatStaysAlone) {
  begin();
  stage_->operate = [](const auto&) { return std::optional(kPoses[0]); };
  int after = 0;
  ASSERT_TRUE(run(2, [&] { return poses_->size() == 1 && ++after > 10; }));
  EXPECT_EQ(poses_->size(), 1u);
  EXPECT_THAT(out_.str(), Not(HasSubstr("not taken")));
}

TEST_F(CalibrationSession, WaitsUntilTheBoardIsStill) {
  begin();
  stage_->operate = [](const BoardStage& stage) {
    HeldBoard held = kPoses[0];
    held.middle_mm.x() += 2.0 * std::max(0, 6 - stage.pictures());
    return std::optional(held);
  };
  ASSERT_TRUE(run(1, [&] { return stage_->pictures() == 5; }));
  EXPECT_EQ(stage_->coded(), 0);
  ASSERT_TRUE(run(1));
  EXPECT_EQ(poses_->size(), 1u) << out_.str();
}

TEST_F(CalibrationSession, RefusesABoardThatMovesMeanwhileAndTriesAgain) {
  begin();
  stage_->frame = 1s;
  stage_->operate = [](const BoardStage& stage) {
    HeldBoard held = kPoses[0];
    if (stage.coded() > 0) held.middle_mm.x() += 2;
    return std::optional(held);
  };
  ASSERT_TRUE(run(1));
  EXPECT_THAT(out_.str(), HasSubstr("not taken: moved"));
  EXPECT_EQ(poses_->size(), 1u) << out_.str();
  EXPECT_EQ(stage_->coded(), 2);
  const auto listed = list_captures(folder_.path());
  ASSERT_TRUE(listed);
  EXPECT_EQ(listed->size(), 1u);
}

TEST_F(CalibrationSession, RefusesAClippedBoard) {
  begin();
  stage_->exposure = 2.5;
  ASSERT_TRUE(run(1, [&] { return says("not taken"); }));
  EXPECT_THAT(out_.str(), HasSubstr("clipped"));
  EXPECT_EQ(poses_->size(), 0u);
  EXPECT_FALSE(holds_poses(folder_.path()));
}

// Six corners are enough to find a board, but not for the calibration.
TEST_F(CalibrationSession, RefusesABoardOfWhichTooLittleIsSeen) {
  board_ = *parse_board("charuco:4x3:50:37.5:DICT_5X5_1000");
  begin();
  ASSERT_TRUE(run(1, [&] { return says("not taken"); }));
  EXPECT_THAT(out_.str(), HasSubstr("not taken: only 6 of the board's corners were found, but 8 are needed"));
  EXPECT_EQ(poses_->size(), 0u);
}

TEST_F(CalibrationSession, SaysWhatToDoWhereNoBoardIsSeen) {
  begin();
  stage_->operate = [](const auto&) { return std::nullopt; };
  stage_->frame = 20s;
  ASSERT_TRUE(run(1, [&] { return stage_->passed() > 75s; }));
  EXPECT_THAT(out_.str(), HasSubstr("no board in view for 60 s"));
  EXPECT_THAT(out_.str(), HasSubstr("camera left: "));
}

TEST_F(CalibrationSession, NamesACameraThatDoesNotSeeTheBoard) {
  begin({"left", "right"});
  stage_->blind = [](std::size_t camera) { return camera == 1; };
  ASSERT_TRUE(run(1));
  ASSERT_EQ(poses_->size(), 1u) << out_.str();
  EXPECT_EQ(poses_->observations().poses[0].views.size(), 1u);
  EXPECT_THAT(out_.str(), HasSubstr("without camera right: "));
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / "pose_00" / "left" / "white.png"));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "pose_00" / "right"));
}

TEST_F(CalibrationSession, TakesAGrayCode) {
  begin({"left"}, true);
  stage_->samples = 1;
  ASSERT_TRUE(run(1));
  ASSERT_EQ(poses_->size(), 1u) << out_.str();
  EXPECT_GE(poses_->observations().poses[0].views.at(0).symbols.size(), 30u);
  const auto listed = list_captures(folder_.path());
  ASSERT_TRUE(listed) << to_string(listed.error());
  EXPECT_EQ(listed->at(0).cameras.at("").gray.size(), gray_code_images(projector_));
  EXPECT_FALSE(listed->at(0).cameras.at("").black.empty());
}

TEST_F(CalibrationSession, EndsAtOnceWhereTheDevicesDoNotBegin) {
  begin();
  stage_->lost = [](const auto&) { return true; };
  const auto taken = run(1);
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().code, ErrorCode::kTimeout);
  EXPECT_EQ(stage_->pictures(), 1);
}

// As at the first view of the reference plane, after the poses.
TEST_F(CalibrationSession, OutlivesDevicesThatAreLostAtTheFirstViewAfterOtherPoses) {
  begin();
  options_.begun = true;
  stage_->lost = [](const BoardStage& stage) { return stage.pictures() < 4; };
  const auto taken = run(1);
  ASSERT_TRUE(taken) << to_string(taken.error());
  EXPECT_EQ(poses_->size(), 1u) << out_.str();
}

TEST_F(CalibrationSession, OutlivesDevicesThatAreLostForAWhile) {
  begin();
  stage_->lost = [](const BoardStage& stage) { return stage.pictures() > 1 && stage.pictures() < 5; };
  ASSERT_TRUE(run(1));
  EXPECT_EQ(poses_->size(), 1u) << out_.str();
  EXPECT_THAT(out_.str(), HasSubstr("the camera is not ready"));
}

TEST_F(CalibrationSession, EndsWhereDevicesAreLostForLong) {
  begin();
  stage_->lost = [](const BoardStage& stage) { return stage.pictures() > 1; };
  const auto taken = run(1);
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().code, ErrorCode::kTimeout);
  EXPECT_GE(stage_->passed(), 60s);
}

TEST_F(CalibrationSession, RefusesAFolderOfPicturesOfAnotherSize) {
  begin();
  Observations other;
  other.cameras = {{"left", {640, 480}}};
  other.projector = projector_;
  poses_ = std::make_unique<PoseCollection>(board_, other);
  const auto taken = run(1);
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().code, ErrorCode::kMismatch);
}

}  // namespace
}  // namespace slsd
