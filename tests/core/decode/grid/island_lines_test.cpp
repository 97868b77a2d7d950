// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <functional>

#include "tests/core/decode/grid/shown_islands.hpp"

namespace slsd {
namespace {

class IslandsAroundARow : public test::ShownIslands {};

// Two rows at one depth named the row between them, wherever its letters agreed.
TEST_F(IslandsAroundARow, NameNoRowBetweenThemThatIsAtAnotherDepth) {
  for (int slid = 1; slid <= 6; ++slid) {
    grid_ = {}, shapes_.clear();
    show_pattern(10, 10, 20, 50);
    show_pattern(20, 10, 21, 50, slid);
    show_pattern(21, 10, 30, 50);
    const auto claims = decode();
    for (int column = 10; column < 50; ++column) {
      const CellClaim& claim = claims[grid_.node_at(20, column)];
      EXPECT_FALSE(claim.status == RegionStatus::kDecoded && claim.same_cell(20, column)) << slid << ": " << column;
    }
    EXPECT_GT(decoded(claims), 690);
  }
}

TEST_F(IslandsAroundARow, NameNoSevenOfARowBetweenThemThatAgreeByChance) {
  show_pattern(10, 10, 20, 50);
  show_pattern(20, 10, 21, 27, 3);
  show_pattern(20, 27, 21, 34);
  show_pattern(20, 34, 21, 50, 3);
  show_pattern(21, 10, 30, 50);
  const auto claims = decode();
  for (int column = 27; column < 34; ++column) EXPECT_FALSE(is_decoded(claims, 20, column)) << column;
}

// Letters that come again some columns on: as many as chance never brings agree with the row of another depth.
TEST_F(IslandsAroundARow, NameNothingThatARowSlidAlongItsLineExplainsBetter) {
  constexpr int kSlid = 3, kFirst = 25, kLast = 40;
  for (int column = kFirst; column < kLast; ++column)
    pattern_.array.cells[20 * pattern_.array.columns + column + kSlid] =
        pattern_.array.cells[20 * pattern_.array.columns + column];
  show_pattern(10, 10, 20, 50);
  show_pattern(20, 10, 21, 50, kSlid);
  show_pattern(21, 10, 30, 50);
  const auto slid = [](int row) { return row == 20 ? kSlid : 0; };
  const auto without_lines = decode();
  EXPECT_TRUE(is_decoded(without_lines, 20, (kFirst + kLast) / 2)) << "the letters alone tell nothing";
  const auto claims = decode(lines_through(2000, slid));
  for (int column = 10; column < 50; ++column) EXPECT_FALSE(is_decoded(claims, 20, column)) << column;
  EXPECT_GT(decoded(claims), 690);
}

// Symbols hard to tell, most of which look like those some columns on. Where one of them is unlikely to be its own
// cell's letter, that explains the row better, and those between them that are right fall with it.
TEST_F(IslandsAroundARow, LookForARowSlidWhereALetterIsUnlikely) {
  constexpr int kSlid = 3, kFirst = 24, kLast = 36;
  const auto letter = [&](int column) { return pattern_.array.at(20, column); };
  const auto right_of = [&](double log_ratio) {
    grid_ = {}, shapes_.clear();
    show_pattern(10, 10, 30, 50);
    const double own = std::exp(log_ratio) / 5;
    for (int column = kFirst; column < kLast; ++column)
      shapes_[grid_.node_at(20, column)] = read_as(letter(column + kSlid), 5, 1 - 4 * own);
    const auto claims = decode(lines_through(2000, [](int) { return 0; }));
    int right = 0;
    for (int column = kFirst; column < kLast; ++column) right += is_decoded(claims, 20, column);
    return right;
  };
  EXPECT_GT(right_of(-0.25), 0);
  EXPECT_EQ(right_of(-0.35), 0);
}

// Ten letters that come again three columns on fit one depth as well as the other.
TEST_F(IslandsAroundARow, NameNoRowThatItsOwnLettersElsewhereExplainAsWell) {
  constexpr int kSlid = 3, kFirst = 25, kLast = 35;
  const auto letter = [&](int column) -> auto& {
    return pattern_.array.cells[20 * pattern_.array.columns + column];
  };
  for (int column = kFirst; column < kLast; ++column) letter(column + kSlid) = letter(column);
  show_pattern(10, 10, 20, 50);
  show_pattern(20, kFirst, 21, kLast, kSlid);
  show_pattern(21, 10, 30, 50);
  int other = 0;  // of neither depth
  while (other == letter(kFirst - 1) || other == letter(kFirst - 1 + kSlid)) ++other;
  show(20, kFirst - 1, other);
  const auto of_one_depth = [](int) { return 0; };
  const auto claims = decode(lines_through(2000, of_one_depth));
  for (int column = kFirst; column < kLast; ++column) EXPECT_FALSE(is_decoded(claims, 20, column)) << column;
  EXPECT_GT(decoded(claims), 690);
}

/// Below a sheet some of a row, moved along its line, a third of whose symbols are anyone's guess.
class IslandsAboveAShortRow : public test::ShownIslands {
 protected:
  int kept(float away_px, float above_px = 0, bool knows_lines = true) {
    grid_ = {}, shapes_.clear();
    show_pattern(10, 10, 13, 41);
    show_pattern(13, 10, 14, 16);
    for (int column = 10; column < 16; ++column) {
      grid_.nodes[grid_.node_at(13, column)].centre_px.x() += away_px;
      grid_.nodes[grid_.node_at(12, column)].centre_px.x() += above_px;
      if (column % 3 == 0) shapes_[grid_.node_at(13, column)] = read_as(0, 5, 0.2);
    }
    const auto claims = knows_lines ? decode(lines_through(2000, [](int) { return 0; })) : decode();
    int count = 0;
    for (int column = 10; column < 16; ++column) count += is_decoded(claims, 13, column);
    return count;
  }
};

TEST_F(IslandsAboveAShortRow, KeepItOnTheirGrid) {
  EXPECT_GE(kept(0), 4);
  EXPECT_GE(kept(0.05F), 4);
}

TEST_F(IslandsAboveAShortRow, LoseItOffTheirGrid) {
  EXPECT_EQ(kept(0.4F), 0);
  EXPECT_EQ(kept(-0.4F), 0);
  EXPECT_EQ(kept(0.1F), 0);
}

TEST_F(IslandsAboveAShortRow, KeepItWhereTheyTurnAway) {
  EXPECT_GE(kept(0.5F, 0.12F), 4);  // slips of 0.26 px and 0.12 px
}

TEST_F(IslandsAboveAShortRow, LoseItWhereTheyTurnAwayTooFast) {
  EXPECT_GE(kept(0.6F, 0.12F), 4);   // slips of 0.36 px and 0.12 px
  EXPECT_EQ(kept(0.84F, 0.12F), 0);  // and of 0.6 px
}

TEST_F(IslandsAboveAShortRow, KeepItWhereNothingTellsWhatDepthWouldMove) {
  EXPECT_GE(kept(0.4F, 0, false), 4);
}

/// What becomes of a row in a sheet's midst whose letters are right and lie so far off their lines.
class IslandsWithARowOffItsLines : public test::ShownIslands {
 protected:
  int kept(const std::function<double(int)>& off_px, float distance = 1) {
    grid_ = {}, shapes_.clear();
    show_pattern(10, 10, 20, 40);
    std::vector<EpipolarSegment> segments;
    for (const auto& [row, column] : grid_.cells)
      segments.push_back(line_below(row, column, row == 15 ? off_px(column) : 0));
    for (int column = 10; column < 40; ++column) shapes_[grid_.node_at(15, column)].distance = distance;
    const auto claims = decode(segments);
    int count = 0;
    for (int column = 10; column < 40; ++column) count += is_decoded(claims, 15, column);
    EXPECT_GE(decoded(claims), 265);  // of 270 in the other rows
    return count;
  }
};

// The row of another surface, some columns on, whose letters come again: no depth puts it off its lines.
TEST_F(IslandsWithARowOffItsLines, LoseItWhereAllOfItIs) {
  EXPECT_EQ(kept([](int) { return 0.8; }), 0);
  EXPECT_EQ(kept([](int column) { return -0.8 + (column % 2 == 0 ? 0.05 : -0.05); }), 0);
}

TEST_F(IslandsWithARowOffItsLines, KeepWhatIsLittleOff) {
  EXPECT_EQ(kept([](int) { return 0.24; }), 30);
}

// An edge that cuts the row moves each letter as it is.
TEST_F(IslandsWithARowOffItsLines, KeepWhatIsUnevenlyOff) {
  EXPECT_GE(kept([](int column) { return 0.4 + 0.25 * (column % 4); }), 28);
}

// A third of them lie at the median, the others to both sides of it.
TEST_F(IslandsWithARowOffItsLines, TakeWhatIsAnEighthOffTheMedianForAlike) {
  const auto spread = [](double share) { return [share](int column) { return 0.8 * (1 + share * (column % 3 - 1)); }; };
  EXPECT_EQ(kept(spread(0.11)), 0);
  EXPECT_GE(kept(spread(0.14)), 28);
}

TEST_F(IslandsWithARowOffItsLines, KeepWhatIsNotWellSeen) {
  EXPECT_GE(kept([](int) { return 0.8; }, 4), 28);
}

}  // namespace
}  // namespace slsd
