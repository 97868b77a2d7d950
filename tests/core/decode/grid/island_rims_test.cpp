// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <initializer_list>
#include <random>
#include <utility>

#include "tests/core/decode/grid/shown_islands.hpp"

namespace slsd {
namespace {

class IslandsWithRims : public test::ShownIslands {};

TEST_F(IslandsWithRims, AreNoLargerForNodesThatChanceAddsAtTheirRim) {
  show_pattern(10, 10, 20, 30);
  std::mt19937 random(4);
  for (int row = 20; row < 30; ++row)
    for (int column = 10; column < 30; ++column) show(row, column, static_cast<int>(random() % 5));
  const auto claims = decode();
  int alike = 0;
  for (std::size_t i = 200; i < claims.size(); ++i) {
    const auto [row, column] = grid_.cells[i];
    alike += shapes_[i].letter == pattern_.array.at(row, column);
    EXPECT_NE(claims[i].status, RegionStatus::kDecoded) << row << ", " << column;
  }
  EXPECT_GT(alike, 20);             // so many letters are the pattern's by chance
  EXPECT_GE(decoded(claims), 175);  // corners that lie beside them may be theirs
}

TEST_F(IslandsWithRims, LoseNothingAtAStraightEdgeInDepth) {
  show_pattern(10, 10, 20, 40);
  show_pattern(20, 10, 30, 40, 7);
  const auto claims = decode();
  EXPECT_GE(decoded(claims), 560);  // of 600
  for (std::size_t i = 0; i < claims.size(); ++i) {
    const auto [row, column] = grid_.cells[i];
    if (claims[i].status == RegionStatus::kDecoded) {
      EXPECT_TRUE(claims[i].same_cell(row, row < 20 ? column : column + 7));
    }
  }
}

TEST_F(IslandsWithRims, KeepThinBandsWhoseLettersAllAgree) {
  std::mt19937 random(3);
  show_pattern(15, 10, 21, 50);
  for (const int row : {13, 14, 21, 22})
    for (int column = 10; column < 50; ++column) show(row, column, static_cast<int>(random() % 5));
  const auto claims = decode();
  int right = 0;
  for (int row = 15; row < 21; ++row)
    for (int column = 10; column < 50; ++column) right += is_decoded(claims, row, column);
  EXPECT_GE(right, 120);  // of 240
}

/// Another part of the pattern in the place of rows 16 to 18 and columns 20 to 24.
class PatchedIslands : public test::ShownIslands {
 protected:
  PatchedIslands() {
    show_pattern(10, 10, 30, 40);
    for (int row = 16; row < 19; ++row)
      for (int column = 20; column < 25; ++column) put(row, column, 1);
  }
  /// Its letter, or one that is so many on from it.
  void put(int row, int column, int on) {
    shapes_[grid_.node_at(row, column)] = read_as((pattern_.array.at(row, column) + on) % 5, 5, kSure);
  }
};

TEST_F(PatchedIslands, GiveUpTheCornerOfThePatchThatAgreesByChance) {
  for (const auto& [row, column] : {std::pair(18, 24), {18, 23}, {18, 22}, {17, 24}}) put(row, column, 0);
  EXPECT_FALSE(is_decoded(decode(), 18, 24));
}

// As may what comes before one that is cut, up to where they would be too many for chance.
TEST_F(PatchedIslands, GiveUpAllFromTheCornerOfThePatchThatAgreeByChance) {
  for (int row = 16; row < 19; ++row)
    for (int column = 20; column < 25; ++column) put(row, column, row < 18 && column > 21 ? 1 : 0);
  put(16, 22, 0);
  shapes_[grid_.node_at(17, 20)] = read_as(0, 5, 0.2);
  const auto claims = decode();
  for (int column = 20; column < 23; ++column) EXPECT_FALSE(is_decoded(claims, 16, column)) << column;
  EXPECT_TRUE(is_decoded(claims, 16, 19));
}

TEST_F(PatchedIslands, GiveUpWhatIsBesideAWellSeenContradiction) {
  put(25, 30, 1);
  const auto claims = decode();
  for (const auto& [row, column] : {std::pair(24, 30), {26, 30}, {25, 29}, {25, 31}})
    EXPECT_FALSE(is_decoded(claims, row, column)) << row << ", " << column;
  EXPECT_TRUE(is_decoded(claims, 23, 30));
  EXPECT_TRUE(is_decoded(claims, 25, 28));
}

/// Four symbols at a rim, below which letters of something else lie, moved along their rows.
class IslandsAtAnEdge : public test::ShownIslands {
 protected:
  std::vector<CellClaim> decode_with(float away_px, bool knows_lines, float noise_px = 0) {
    show_pattern(10, 10, 14, 41);
    for (int row = 14; row < 18; ++row) {
      show(row, 40, (pattern_.array.at(row, 40) + 1) % 5);
      grid_.nodes.back().centre_px.x() += away_px;
    }
    std::mt19937 random(5);
    std::normal_distribution<float> noise(0, noise_px);
    if (noise_px > 0) {
      for (GridNode& node : grid_.nodes)
        for (float& coordinate : node.centre_px) coordinate += noise(random);
    }
    return knows_lines ? decode(lines_through(2000, [](int) { return 0; })) : decode();
  }
  int kept(const std::vector<CellClaim>& claims) const {
    int count = 0;
    for (int row = 10; row < 14; ++row) count += is_decoded(claims, row, 40);
    return count;
  }
};

TEST_F(IslandsAtAnEdge, KeepWhatAContradictionOffTheGridLiesBeside) {
  EXPECT_EQ(kept(decode_with(1.8F, true)), 4);  // a tenth of a step
}

TEST_F(IslandsAtAnEdge, LoseWhatAContradictionOnTheGridLiesBeside) {
  EXPECT_EQ(kept(decode_with(0, true)), 0);
}

TEST_F(IslandsAtAnEdge, TakeAHundredthOfAStepForAnotherDepthAndHalfOfItForNone) {
  EXPECT_EQ(kept(decode_with(0.1F, true)), 0);
  grid_ = {}, shapes_.clear();
  EXPECT_EQ(kept(decode_with(0.2F, true)), 4);
}

TEST_F(IslandsAtAnEdge, LoseItWhereTheGridItselfIsAsUneven) {
  EXPECT_EQ(kept(decode_with(1.2F, true)), 4);
  grid_ = {}, shapes_.clear();
  EXPECT_EQ(kept(decode_with(1.2F, true, 0.19F)), 0);  // half of its slips are beyond a quarter of it
}

TEST_F(IslandsAtAnEdge, LoseItWhereNothingTellsWhatDepthWouldMove) {
  EXPECT_EQ(kept(decode_with(1.8F, false)), 0);
}

/// How the last row of a sheet fits it, which lies so far along its line from where the sheet would go on.
class IslandsWithALastRow : public IslandsAtAnEdge {
 protected:
  GridFit fit_of(float away_px, float below_px = 1.8F, bool knows_lines = true) {
    show_last_row(away_px, below_px);
    const auto claims = knows_lines ? decode(lines_through(2000, [](int) { return 0; })) : decode();
    return claims[grid_.node_at(13, 30)].grid_fit;
  }
  /// The same of one so far off its line, among others that are so far off theirs.
  GridFit fit_off_line(double off_px, double others_px) {
    show_last_row(0, 1.8F);
    std::vector<EpipolarSegment> segments;
    for (const auto& [row, column] : grid_.cells) segments.push_back(line_below(row, column, others_px));
    segments[grid_.node_at(13, 30)] = line_below(13, 30, off_px);
    return decode(segments)[grid_.node_at(13, 30)].grid_fit;
  }

 private:
  void show_last_row(float away_px, float below_px) {
    grid_ = {}, shapes_.clear();
    show_pattern(10, 10, 14, 41);
    for (int column = 10; column < 41; ++column) grid_.nodes[grid_.node_at(13, column)].centre_px.x() += away_px;
    show(14, 30, (pattern_.array.at(14, 30) + 1) % 5);
    grid_.nodes.back().centre_px.x() += away_px + below_px;
  }
};

TEST_F(IslandsWithALastRow, FitTightlyWhereTheyLeadToIt) {
  EXPECT_EQ(fit_of(0), GridFit::kTight);
  EXPECT_EQ(fit_of(0.05F), GridFit::kTight);
}

TEST_F(IslandsWithALastRow, FitLooselyUpToTheSlipOfASurface) {
  EXPECT_EQ(fit_of(0.1F), GridFit::kLoose);
  EXPECT_EQ(fit_of(-0.1F), GridFit::kLoose);
}

TEST_F(IslandsWithALastRow, DoNotFitAtAnotherDepth) {
  EXPECT_EQ(fit_of(0.2F), GridFit::kNone);
  EXPECT_EQ(fit_of(-0.2F), GridFit::kNone);
}

TEST_F(IslandsWithALastRow, FitLooselyBesideOtherLightOnTheGrid) {
  EXPECT_EQ(fit_of(0, 0), GridFit::kLoose);
}

// What is left of two symbols has its centre anywhere.
TEST_F(IslandsWithALastRow, FitLooselyFarOffItsLine) {
  EXPECT_EQ(fit_off_line(0.09, 0), GridFit::kTight);
  EXPECT_EQ(fit_off_line(0.11, 0), GridFit::kLoose);
  EXPECT_EQ(fit_off_line(0.45, 0.05), GridFit::kTight);
  EXPECT_EQ(fit_off_line(0.55, 0.05), GridFit::kLoose);
}

TEST_F(IslandsWithALastRow, DoNotFitWhereNothingTellsWhatDepthWouldMove) {
  EXPECT_EQ(fit_of(0, 1.8F, false), GridFit::kNone);
}

/// A surface whose last columns come closer together, each by so much, up to where its links break.
class IslandsThatTurnAway : public test::ShownIslands {
 protected:
  int kept(std::initializer_list<float> closer, bool breaks_off = true) {
    constexpr int kTop = 10, kBottom = 14, kRim = 40;
    show_pattern(kTop, 10, kBottom, kRim + 1);
    for (int row = kBottom; row < 20; ++row)
      for (int column = 10; column < kRim; ++column) show(row, column, pattern_.array.at(row, column));
    for (int row = kTop; row < kBottom; ++row) {
      int column = kRim;
      for (const float steps : closer) grid_.nodes[grid_.node_at(row, column--)].centre_px.x() -= 18 * steps;
      grid_.nodes[grid_.node_at(row, kRim)].broken[kRight] = breaks_off;
    }
    const auto claims = decode();
    int count = 0;
    for (int row = kTop; row < kBottom; ++row) count += is_decoded(claims, row, kRim);
    return count;
  }
};

TEST_F(IslandsThatTurnAway, KeepTheirLimb) {
  EXPECT_EQ(kept({0.18F, 0.04F, 0.01F}), 4);  // bends of 0.11, 0.02 and 0.01
}

TEST_F(IslandsThatTurnAway, LoseWhatBendsFasterThanALimb) {
  EXPECT_EQ(kept({0.31F, 0.04F, 0.01F}), 0);  // bends of 0.24, 0.02 and 0.01
}

TEST_F(IslandsThatTurnAway, LoseWhatBendsAtOnce) {
  EXPECT_EQ(kept({0.12F}), 4);
  EXPECT_EQ(kept({0.18F}), 0);
}

TEST_F(IslandsThatTurnAway, LoseWhatBendsAtOnceWhereNothingLiesBesideIt) {
  EXPECT_EQ(kept({0.12F}, false), 4);
  EXPECT_EQ(kept({0.18F}, false), 0);
}

// What lies across the epipolar lines is no other depth: of the island's own surface, whatever moved it.
TEST_F(PatchedIslands, TellContradictionsOfAnotherDepthAlongTheLinesAlone) {
  put(25, 30, 1);
  const std::vector<std::pair<int, int>> around{{24, 30}, {26, 30}, {25, 29}, {25, 31}};
  const auto lines = lines_through(2000, [](int) { return 0; });
  const auto kept = [&] {
    const auto claims = decode(lines);
    return std::ranges::count_if(around, [&](const auto& cell) { return is_decoded(claims, cell.first, cell.second); });
  };
  Eigen::Vector2f& centre_px = grid_.nodes[grid_.node_at(25, 30)].centre_px;
  centre_px += Eigen::Vector2f(1.8F, 0);
  EXPECT_EQ(kept(), 4);
  centre_px += Eigen::Vector2f(-1.8F, 1.8F);
  EXPECT_EQ(kept(), 0);
}

}  // namespace
}  // namespace slsd
