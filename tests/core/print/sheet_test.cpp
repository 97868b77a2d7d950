// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/print/sheet.hpp"

#include <gmock/gmock.h>

namespace slsd {
namespace {

using ::testing::HasSubstr;

TEST(LayOut, KeepsTheBoardWithinThePaper) {
  for (const char* name : {"A0", "A1", "A2", "A3", "A4", "letter", "100x80"}) {
    const Paper paper = *parse_paper(name);
    const auto sheet = lay_out(*board_for(paper), paper);
    ASSERT_TRUE(sheet) << to_string(sheet.error());
    EXPECT_GE(sheet->origin_mm.minCoeff(), 8 + sheet->clear_mm) << name;
    EXPECT_LE(sheet->origin_mm.x() + sheet->board.width_mm() + sheet->clear_mm + 8, paper.width_mm) << name;
    EXPECT_LE(sheet->origin_mm.y() + sheet->board.height_mm() + sheet->clear_mm + 8, paper.height_mm) << name;
  }
}

TEST(LayOut, TurnsThePaper) {
  const auto sheet = lay_out(*parse_board("charuco:5x8:25:18:DICT_5X5_50"), *parse_paper("A4"));
  ASSERT_TRUE(sheet) << to_string(sheet.error());
  EXPECT_EQ(sheet->paper, (Paper{"A4", 210, 297}));
}

TEST(LayOut, SaysWhichPaperABoardNeeds) {
  const auto sheet = lay_out(*parse_board("charuco:11x7:60:45:DICT_5X5_1000"), *parse_paper("A4"));
  ASSERT_FALSE(sheet);
  EXPECT_EQ(sheet.error().code, ErrorCode::kImpossible);
  EXPECT_THAT(sheet.error().message, HasSubstr("needs 702 x 467 mm"));
  EXPECT_THAT(sheet.error().message, HasSubstr("A4 has 297 x 210 mm"));
  EXPECT_THAT(sheet.error().message, HasSubstr("--paper A1"));
  const auto none = lay_out(*parse_board("chessboard:90x60:25"), *parse_paper("A4"));
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("smaller --board"));
}

TEST(BoardFor, FillsThePaper) {
  EXPECT_EQ(to_string(*board_for(*parse_paper("A4"))), "charuco:11x7:23:17.25:DICT_5X5_1000");
  EXPECT_EQ(to_string(*board_for(*parse_paper("A1"))), "charuco:11x7:72:54:DICT_5X5_1000");
  EXPECT_FALSE(board_for(*parse_paper("60x50")));
}

}  // namespace
}  // namespace slsd
