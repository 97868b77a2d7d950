// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/board/find_board.hpp"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>

#include "core/board/board_photo.hpp"
#include "core/code/pattern.hpp"
#include "tests/core/board/board_scene.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

using ::testing::HasSubstr;

constexpr const char* kCharuco = "charuco:8x6:60:45:DICT_5X5_1000";
constexpr const char* kChessboard = "chessboard:8x5:60";

struct FinderErrors {
  Eigen::Vector2d bias_px = Eigen::Vector2d::Zero();
  double rms_px = 0;  ///< of one coordinate
};

FinderErrors errors_of(const BoardSighting& sighting, const BoardScene& scene) {
  FinderErrors errors;
  const auto count = static_cast<double>(sighting.points.size());
  for (const SeenPoint& point : sighting.points) {
    const Eigen::Vector2d error = point.pixel - scene.pixel(point.id);
    errors.bias_px += error / count;
    errors.rms_px += error.squaredNorm() / count / 2;
  }
  errors.rms_px = std::sqrt(errors.rms_px);
  return errors;
}

// A board in an image just larger than it, distorted, under a light that falls by a third.
BoardScene view_of(const char* text, double pitch_px, double tilt_rad = 0.4) {
  const Board board = *parse_board(text);
  BoardScene scene = scene_of(board, pitch_px, tilt_rad);
  scene.camera.width_px = static_cast<int>((board.width_mm() / board.pitch_mm + 3) * pitch_px);
  scene.camera.height_px = static_cast<int>((board.height_mm() / board.pitch_mm + 3) * pitch_px);
  scene.camera.cx = scene.camera.width_px / 2 + 0.3;
  scene.camera.cy = scene.camera.height_px / 2 - 0.4;
  scene.camera.distortion = {-0.12, 0.1, 0.001, -0.0007, 0};
  scene.falling_light = 0.3;
  return scene;
}

struct Case {
  const char* board;
  double pitch_px;
  double rms_px;
};

class FindBoardAtScale : public ::testing::TestWithParam<Case> {};

TEST_P(FindBoardAtScale, PutsPointsWhereTheyAre) {
  const BoardScene scene = view_of(GetParam().board, GetParam().pitch_px);
  const auto sighting = find_board(photograph8(scene).view(), scene.board);
  ASSERT_TRUE(sighting) << to_string(sighting.error());
  EXPECT_EQ(sighting->points.size(), static_cast<std::size_t>(scene.board.point_count()));
  const FinderErrors errors = errors_of(*sighting, scene);
  EXPECT_LT(std::abs(errors.bias_px.x()), 0.02);
  EXPECT_LT(std::abs(errors.bias_px.y()), 0.02);
  EXPECT_LT(errors.rms_px, GetParam().rms_px);
  EXPECT_NEAR(sighting->edge_px, 0.75, 0.22);
  EXPECT_NEAR(sighting->pitch_px, 0.92 * GetParam().pitch_px, 0.08 * GetParam().pitch_px);
  EXPECT_GT(sighting->contrast, 0.4);
  EXPECT_EQ(sighting->clipped_share, 0);
}

INSTANTIATE_TEST_SUITE_P(Boards, FindBoardAtScale,
                         ::testing::Values(Case{kCharuco, 17, 0.05}, Case{kCharuco, 30, 0.03}, Case{kCharuco, 90, 0.02},
                                           Case{kChessboard, 12, 0.05}, Case{kChessboard, 30, 0.03},
                                           Case{kChessboard, 90, 0.02}, Case{"circles:4x7:30:30", 14, 0.03},
                                           Case{"circles:4x7:30:30", 60, 0.02},
                                           Case{"plane:4x3:60:45:DICT_5X5_50", 30, 0.08},
                                           Case{"plane:4x3:60:45:DICT_5X5_50", 90, 0.04}));

// A disc's ellipse has its centre elsewhere: without the correction this one has an RMS of half a pixel.
TEST(FindBoard, PutsDiscsWhereTheirCentresAre) {
  const BoardScene scene = view_of("circles:3x5:30:34", 60, 0.9);
  const auto sighting = find_board(photograph8(scene).view(), scene.board);
  ASSERT_TRUE(sighting) << to_string(sighting.error());
  EXPECT_LT(errors_of(*sighting, scene).rms_px, 0.03);
}

TEST(FindBoard, ReadsSixteenBitsOfAnyRange) {
  const BoardScene scene = view_of(kCharuco, 30);
  Grey16 image = photograph16(scene);
  for (std::size_t i = 0; i < image.size(); ++i) image.data()[i] = static_cast<std::uint16_t>(image.data()[i] / 64);
  const auto sighting = find_board(image.view(), scene.board);
  ASSERT_TRUE(sighting) << to_string(sighting.error());
  EXPECT_EQ(sighting->points.size(), static_cast<std::size_t>(scene.board.point_count()));
  EXPECT_LT(errors_of(*sighting, scene).rms_px, 0.03);
}

TEST(FindBoard, FindsThePartOfACharucoBoardThatIsSeen) {
  BoardScene scene = view_of(kCharuco, 30);
  scene.origin_mm.x() += 4 * scene.board.pitch_mm;
  const auto sighting = find_board(photograph8(scene).view(), scene.board);
  ASSERT_TRUE(sighting) << to_string(sighting.error());
  EXPECT_GT(sighting->points.size(), 10U);
  EXPECT_LT(sighting->points.size(), 30U);
  EXPECT_LT(errors_of(*sighting, scene).rms_px, 0.03);
}

Grey8 turned_about(const Grey8& image) {
  Grey8 turned = image;
  std::reverse(turned.data(), turned.data() + turned.size());
  return turned;
}

// The pixel of a point in an image that was turned by half a turn.
Eigen::Vector2d turned_about(const BoardScene& scene, int id) {
  return Eigen::Vector2d(scene.camera.width_px - 1, scene.camera.height_px - 1) - scene.pixel(id);
}

TEST(FindBoard, TellsWhichWayUpABoardIs) {
  for (const char* text : {kCharuco, kChessboard, "circles:4x7:30:30"}) {
    const BoardScene scene = view_of(text, 24);
    const auto sighting = find_board(turned_about(photograph8(scene)).view(), scene.board);
    ASSERT_TRUE(sighting) << to_string(sighting.error());
    EXPECT_FALSE(sighting->half_turn_ambiguous) << text;
    EXPECT_LT((sighting->points[0].pixel - turned_about(scene, sighting->points[0].id)).norm(), 0.3) << text;
  }
}

TEST(FindBoard, SaysWhereThatCannotBeTold) {
  const BoardScene scene = view_of("chessboard:7x5:60", 24);
  const Grey8 image = photograph8(scene);
  for (const Grey8& one : {image, turned_about(image)}) {
    const auto sighting = find_board(one.view(), scene.board);
    ASSERT_TRUE(sighting) << to_string(sighting.error());
    EXPECT_TRUE(sighting->half_turn_ambiguous);
    EXPECT_LT(sighting->points[0].pixel.x(), sighting->points[6].pixel.x());
  }
}

Error error_of(const Grey8& image, const char* board) {
  const auto sighting = find_board(image.view(), *parse_board(board));
  return sighting ? Error{ErrorCode::kBusy, "found " + std::to_string(sighting->points.size()), ""} : sighting.error();
}

TEST(FindBoard, SeesNoBoardInAnEmptyImage) {
  for (const char* board : {kCharuco, kChessboard, "circles:4x7:30:30", "plane:4x3:60:45:DICT_5X5_50"}) {
    const Error error = error_of(Grey8(320, 240, 128), board);
    EXPECT_EQ(error.code, ErrorCode::kNotFound) << board << error.message;
    EXPECT_THAT(error.message, HasSubstr("visible")) << board;
  }
}

TEST(FindBoard, NamesAnotherBoard) {
  const Grey8 charuco = photograph8(view_of(kCharuco, 30));
  const Error ids = error_of(charuco, "charuco:5x3:60:45:DICT_5X5_1000");
  EXPECT_EQ(ids.code, ErrorCode::kMismatch) << ids.message;
  EXPECT_THAT(ids.message, HasSubstr("it has the marker 23"));
  const Error layout = error_of(charuco, "charuco:7x7:60:45:DICT_5X5_1000");
  EXPECT_EQ(layout.code, ErrorCode::kMismatch) << layout.message;
  EXPECT_THAT(layout.message, HasSubstr("not where"));
  const Error family = error_of(charuco, "charuco:8x6:60:45:DICT_6X6_50");
  EXPECT_EQ(family.code, ErrorCode::kMismatch) << family.message;
  EXPECT_THAT(family.message, HasSubstr("its markers are of DICT_5X5_50"));
  const Error squares = error_of(photograph8(view_of(kChessboard, 30)), "chessboard:6x4:60");
  EXPECT_EQ(squares.code, ErrorCode::kMismatch) << squares.message;
  EXPECT_THAT(squares.message, HasSubstr("8x5 inner corners"));
}

TEST(FindBoard, NamesAMirroredImage) {
  const Error charuco = error_of(mirrored(photograph8(view_of(kCharuco, 30))), kCharuco);
  EXPECT_EQ(charuco.code, ErrorCode::kMismatch) << charuco.message;
  EXPECT_THAT(charuco.message, HasSubstr("mirror"));
}

TEST(FindBoard, NamesTheLegacyPattern) {
  BoardScene scene = view_of(kCharuco, 30);
  scene.legacy = true;
  const Error error = error_of(photograph8(scene), kCharuco);
  EXPECT_EQ(error.code, ErrorCode::kMismatch) << error.message;
  EXPECT_THAT(error.message, HasSubstr("legacy pattern"));
}

TEST(FindBoard, SaysThatAChessboardIsCutOff) {
  BoardScene scene = view_of(kChessboard, 30, 0.1);
  scene.origin_mm.x() += 4 * scene.board.pitch_mm;
  const Error error = error_of(photograph8(scene), kChessboard);
  EXPECT_EQ(error.code, ErrorCode::kNotFound) << error.message;
  EXPECT_THAT(error.message, HasSubstr("cut off"));
}

TEST(FindBoard, SeesClippedLight) {
  BoardScene scene = view_of(kCharuco, 30);
  scene.white = 400;
  const auto sighting = find_board(photograph8(scene).view(), scene.board);
  ASSERT_TRUE(sighting) << to_string(sighting.error());
  EXPECT_GT(sighting->clipped_share, 0.1);
  EXPECT_LT(sighting->clipped_share, 0.6);
}

TEST(FindBoard, NamesTheReflectionThatHidesTheBoard) {
  Grey8 image = photograph8(view_of(kCharuco, 30));
  for (int y = 0; y < image.height(); ++y) std::fill_n(image.row(y), image.width() * 9 / 10, std::uint8_t{255});
  EXPECT_THAT(error_of(image, kCharuco).message,
              testing::StartsWith("clipped: 90 % of the picture's pixels are at full level"));
}

TEST(FindBoard, MeasuresBlur) {
  BoardScene scene = view_of(kChessboard, 30);
  scene.blur_px = 2;
  const auto sighting = find_board(photograph8(scene).view(), scene.board);
  ASSERT_TRUE(sighting) << to_string(sighting.error());
  EXPECT_NEAR(sighting->edge_px, 2, 0.2);
}

TEST(FindBoard, NeedsNoBlur) {
  BoardScene scene = view_of(kCharuco, 40, 0.1);
  scene.blur_px = scene.noise_levels = scene.falling_light = 0;
  Grey8 image = photograph8(scene);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) image.row(y)[x] = image.row(y)[x] > 100 ? 190 : 15;
  const auto sighting = find_board(image.view(), scene.board);
  ASSERT_TRUE(sighting) << to_string(sighting.error());
  EXPECT_EQ(sighting->points.size(), static_cast<std::size_t>(scene.board.point_count()));
  EXPECT_LT(errors_of(*sighting, scene).rms_px, 0.2);  // edges are stairs of whole pixels
}

// Its symbols make so many squares that OpenCV's search by them may not come to an end.
TEST(FindBoard, NamesThePatternWhereAChessboardIsAskedFor) {
  const Grey8 frame =
      simulate(draw_pattern(make_pattern({}).value()), paper_rig(), plane({0, 0, 2100}, {0.3, 0.2, -1}));
  const auto sighting = find_board(frame.view(), *parse_board("chessboard:7x6:50"));
  ASSERT_FALSE(sighting);
  EXPECT_EQ(sighting.error().code, ErrorCode::kMismatch);
  EXPECT_THAT(sighting.error().message, HasSubstr("not swapped"));
}

}  // namespace
}  // namespace slsd
