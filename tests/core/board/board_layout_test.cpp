// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/board/layout.hpp"

#include <gmock/gmock.h>
#include <opencv2/aruco/charuco.hpp>

#include "core/board/board_ink.hpp"

namespace slsd {
namespace {

double at(float value) {
  return static_cast<double>(value);
}

// Ours is OpenCV's, for odd and even numbers of squares.
TEST(MarkerCorners, AreWhereOpenCvHasThem) {
  for (const char* text : {"charuco:11x7:60:45:DICT_5X5_1000", "charuco:8x6:20:15:DICT_4X4_50",
                           "charuco:5x8:30:22.5:DICT_6X6_250", "charuco:6x9:30:22.5:DICT_6X6_250"}) {
    const Board board = *parse_board(text);
    const auto dictionary = cv::aruco::getPredefinedDictionary(board.family->opencv_number);
    const auto theirs = cv::aruco::CharucoBoard::create(board.columns, board.rows, static_cast<float>(board.pitch_mm),
                                                        static_cast<float>(board.mark_mm), dictionary);
    ASSERT_EQ(theirs->ids.size(), static_cast<std::size_t>(board.marker_count())) << text;
    for (int id = 0; id < board.marker_count(); ++id) {
      const auto corners = marker_corners(board, square_of_marker(board, id));
      for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_NEAR(corners[i].x(), at(theirs->objPoints[id][i].x), 1e-3) << text << " marker " << id;
        EXPECT_NEAR(corners[i].y(), at(theirs->objPoints[id][i].y), 1e-3) << text << " marker " << id;
      }
    }
    for (int id = 0; id < board.point_count(); ++id) {
      EXPECT_NEAR(board.point(id).x(), at(theirs->chessboardCorners[id].x), 1e-3);
      EXPECT_NEAR(board.point(id).y(), at(theirs->chessboardCorners[id].y), 1e-3);
    }
  }
}

TEST(SquareOfMarker, OfTheLegacyLayoutBeginsInTheFirstSquareOfEvenRows) {
  const Board even = *parse_board("charuco:8x6:20:15:DICT_4X4_50");
  EXPECT_EQ(square_of_marker(even, 0).column, 1);
  EXPECT_EQ(square_of_marker(even, 0, true).column, 0);
  const Board odd = *parse_board("charuco:11x7:20:15:DICT_4X4_50");
  EXPECT_EQ(square_of_marker(odd, 0).column, square_of_marker(odd, 0, true).column);
}

bool holds(const BoardInk& ink, double x_mm, double y_mm) {
  for (const auto& r : ink.rectangles) {
    if (x_mm >= r.x_mm && y_mm >= r.y_mm && x_mm < r.x_mm + r.width_mm && y_mm < r.y_mm + r.height_mm) return true;
  }
  return false;
}

TEST(InkOf, IsWhatOpenCvDraws) {
  const Board board = *parse_board("charuco:8x6:28:21:DICT_5X5_50");
  const auto theirs =
      cv::aruco::CharucoBoard::create(8, 6, 28, 21, cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_50));
  cv::Mat drawn;
  theirs->draw({8 * 56, 6 * 56}, drawn);
  const BoardInk ink = ink_of(board);
  int different = 0;
  for (int y = 1; y < drawn.rows; y += 3) {
    for (int x = 1; x < drawn.cols; x += 3) {
      const bool black = drawn.at<unsigned char>(y, x) < 128;
      different += black != holds(ink, (x + 0.5) / 2, (y + 0.5) / 2) ? 1 : 0;
    }
  }
  EXPECT_LT(different, drawn.rows * drawn.cols / 9 / 100);  // its markers are drawn to whole pixels
}

}  // namespace
}  // namespace slsd
