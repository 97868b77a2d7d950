// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/web/boards.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "drivers/files/file.hpp"

namespace slsd::web {
namespace {

const std::filesystem::path kBoards = std::filesystem::path(SLSD_SOURCE_DIR) / "config/boards";

TEST(ReadBoards, ListsTheShippedOnesSmallestPaperFirst) {
  const auto boards = read_boards(kBoards);
  ASSERT_TRUE(boards) << to_string(boards.error());
  ASSERT_EQ(boards->size(), 6U);
  const PrintableBoard& first = boards->front();
  EXPECT_EQ(first.name, "charuco-11x7-23mm-a4");
  EXPECT_EQ(first.board, "charuco:11x7:23:17.25:DICT_5X5_1000");
  EXPECT_NEAR(first.width_mm, 297, 0.1);
  EXPECT_NEAR(first.height_mm, 210, 0.1);
  EXPECT_EQ(first.pdf, read_file(kBoards / "charuco-11x7-23mm-a4.pdf", 1 << 20).value());
  EXPECT_NEAR(boards->back().width_mm, 841, 0.5);
}

TEST(ReadBoards, SaysWhatToInstallWhereNoneAre) {
  const auto boards = read_boards(std::filesystem::path(SLSD_SOURCE_DIR) / "config/no-such-folder");
  ASSERT_FALSE(boards);
  EXPECT_EQ(boards.error().code, ErrorCode::kNotFound);
  EXPECT_NE(boards.error().message.find("install slsd-calibrate"), std::string::npos);
}

TEST(ParseBoardPdf, LeavesOutWhatIsNoBoard) {
  const std::string begin = "%PDF-1.5\n/MediaBox [ 0 0 842 595 ]\n";
  EXPECT_EQ(parse_board_pdf(begin + "/Title (chessboard:9x6:22)").board, "chessboard:9x6:22");
  for (const std::string& text :
       {begin, begin + "/Title (a letter)", begin + "/Title (plane:<b>)", begin + "/Title (plane:6x4", std::string(),
        std::string("/MediaBox [ 0 0 842 595 ] /Title (chessboard:9x6:22)"),
        std::string("%PDF-1.5 /Title (chessboard:9x6:22)"),
        std::string("%PDF-1.5 /MediaBox [ 0 0 0 595 ] /Title (chessboard:9x6:22)"),
        std::string("%PDF-1.5 /MediaBox [ 0 0 842 ] /Title (chessboard:9x6:22)")})
    EXPECT_EQ(parse_board_pdf(text).board, "") << text;
}

}  // namespace
}  // namespace slsd::web
