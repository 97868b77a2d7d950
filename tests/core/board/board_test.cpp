// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/board/board.hpp"

#include <gmock/gmock.h>
#include <rapidcheck.h>

namespace slsd {
namespace {

using ::testing::HasSubstr;

TEST(ParseBoard, ReadsEveryKind) {
  const auto charuco = parse_board("charuco:11x7:60:45:DICT_5X5_1000");
  ASSERT_TRUE(charuco) << to_string(charuco.error());
  EXPECT_EQ(*charuco, (Board{BoardKind::kCharuco, 11, 7, 60, 45, find_marker_family("DICT_5X5_1000")}));
  EXPECT_EQ(*parse_board("chessboard:9x6:25.4"), (Board{BoardKind::kChessboard, 9, 6, 25.4, 0, nullptr}));
  EXPECT_EQ(*parse_board("circles:4x11:20:24.5"), (Board{BoardKind::kCircles, 4, 11, 20, 24.5, nullptr}));
  EXPECT_EQ(*parse_board("plane:8x5:120:40:DICT_4X4_50"),
            (Board{BoardKind::kPlane, 8, 5, 120, 40, find_marker_family("DICT_4X4_50")}));
}

TEST(ParseBoard, ReadsWhatToStringWrites) {
  rc::check([] {
    const auto families = marker_families();
    Board board{
        .kind = *rc::gen::element(BoardKind::kCharuco, BoardKind::kChessboard, BoardKind::kCircles, BoardKind::kPlane),
        .columns = *rc::gen::inRange(3, 7),
        .rows = *rc::gen::inRange(3, 6),
        .pitch_mm = *rc::gen::inRange(1, 1000000) / 1024.0};
    if (board.kind != BoardKind::kChessboard) board.mark_mm = board.pitch_mm * *rc::gen::inRange(1, 100) / 100.0;
    if (board.marker_count() > 0) board.family = &families[*rc::gen::inRange<std::size_t>(0, families.size())];
    const auto read = parse_board(to_string(board));
    RC_ASSERT(read.has_value());
    RC_ASSERT(*read == board);
  });
}

struct Refusal {
  const char* text;
  ErrorCode code;
  const char* says;
};

TEST(ParseBoard, SaysWhatTheFormIs) {
  const std::vector<Refusal> refusals{
      {"", ErrorCode::kMalformed, "charuco:COLSxROWS"},
      {"checkers:8x8:25", ErrorCode::kMalformed, "chessboard:COLSxROWS:SQUARE_MM"},
      {"charuco", ErrorCode::kMalformed, "charuco:COLSxROWS:SQUARE_MM:MARKER_MM:DICTIONARY"},
      {"charuco:11x7:60:45", ErrorCode::kMalformed, "DICTIONARY"},
      {"chessboard:9x6", ErrorCode::kMalformed, "chessboard:COLSxROWS:SQUARE_MM"},
      {"chessboard:9by6:25", ErrorCode::kMalformed, "COLSxROWS"},
      {"chessboard:9x6:25,4", ErrorCode::kMalformed, "25.4"},
      {"chessboard:9x6:25:1", ErrorCode::kMalformed, "chessboard:COLSxROWS:SQUARE_MM"},
      {"chessboard:9.5x6:25", ErrorCode::kMalformed, "COLSxROWS"},
      {"charuco:11x7:60:45:DICT_5X5", ErrorCode::kMalformed, "DICT_5X5_1000"},
      {"chessboard:9x6:nan", ErrorCode::kInvalidArgument, "more than 0"},
      {"chessboard:9x6:-25", ErrorCode::kInvalidArgument, "more than 0"},
      {"chessboard:9x6:1e9", ErrorCode::kInvalidArgument, "10000 mm"},
      {"chessboard:2x6:25", ErrorCode::kInvalidArgument, "3 to 200"},
      {"chessboard:9x2000:25", ErrorCode::kInvalidArgument, "3 to 200"},
      {"charuco:11x7:60:60:DICT_5X5_1000", ErrorCode::kInvalidArgument, "smaller than its square"},
      {"charuco:11x7:60:0:DICT_5X5_1000", ErrorCode::kInvalidArgument, "larger than 0"},
      {"charuco:11x11:60:45:DICT_5X5_50", ErrorCode::kInvalidArgument, "60 markers, but DICT_5X5_50 has 50"},
      {"circles:4x11:20:29", ErrorCode::kInvalidArgument, "touch"},
  };
  for (const Refusal& refusal : refusals) {
    const auto read = parse_board(refusal.text);
    ASSERT_FALSE(read) << refusal.text;
    EXPECT_EQ(read.error().code, refusal.code) << refusal.text;
    EXPECT_THAT(read.error().message, HasSubstr(refusal.says)) << refusal.text;
  }
}

TEST(Board, HasItsPointsWhereItsFrameSays) {
  const Board charuco = *parse_board("charuco:11x7:60:45:DICT_5X5_1000");
  EXPECT_EQ(charuco.point_count(), 60);
  EXPECT_EQ(charuco.point(0), Eigen::Vector3d(60, 60, 0));
  EXPECT_EQ(charuco.point(12), Eigen::Vector3d(180, 120, 0));
  EXPECT_EQ(charuco.width_mm(), 660);
  EXPECT_EQ(charuco.height_mm(), 420);
  const Board chessboard = *parse_board("chessboard:9x6:25");
  EXPECT_EQ(chessboard.point(10), Eigen::Vector3d(50, 50, 0));
  EXPECT_EQ(chessboard.width_mm(), 250);
  EXPECT_EQ(chessboard.height_mm(), 175);
  const Board circles = *parse_board("circles:4x11:20:25");
  EXPECT_EQ(circles.point(0), Eigen::Vector3d(20, 20, 0));
  EXPECT_EQ(circles.point(4), Eigen::Vector3d(40, 40, 0));
  EXPECT_EQ(circles.width_mm(), 180);
  const Board plane = *parse_board("plane:3x2:100:40:DICT_4X4_50");
  EXPECT_EQ(plane.point_count(), 24);
  EXPECT_EQ(plane.point(0), Eigen::Vector3d(30, 30, 0));
  EXPECT_EQ(plane.point(4 * 4 + 2), Eigen::Vector3d(170, 170, 0));
  EXPECT_EQ(plane.points().size(), 24U);
}

TEST(Board, GrowsByTheScaleOfItsPrint) {
  const Board print = parse_board("charuco:11x7:60:45:DICT_5X5_1000")->scaled(0.97);
  EXPECT_DOUBLE_EQ(print.pitch_mm, 58.2);
  EXPECT_DOUBLE_EQ(print.mark_mm, 43.65);
  EXPECT_DOUBLE_EQ(print.point(59).x(), 582);
}

}  // namespace
}  // namespace slsd
