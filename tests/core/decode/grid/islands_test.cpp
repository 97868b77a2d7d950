// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/grid/islands.hpp"

#include <cmath>
#include <numeric>
#include <random>

#include "tests/core/decode/grid/shown_islands.hpp"

namespace slsd {
namespace {

class Islands : public test::ShownIslands {};

TEST_F(Islands, NeedEvidenceForTheBudgetWhereTheyMayLieAnywhere) {
  show_pattern(10, 10, 13, 13);  // nine letters are e^14 to 1, and there are 3124 places
  EXPECT_EQ(decoded(decode()), 0);
  show_pattern(20, 30, 24, 35);
  EXPECT_EQ(decoded(decode()), 20);
}

// The sum in docs/decoder.md. A strip is as sure of its letters as just makes it an island, beneath some other letters.
TEST_F(Islands, NeedTheEvidenceThatTheirRimCosts) {
  constexpr int kHigh = 3, kWide = 20;
  const auto is_accepted = [&](int contradicted, double evidence) {
    grid_ = {}, shapes_.clear();
    show_pattern(10, 10, 10 + kHigh, 10 + kWide);
    const double sure = std::exp(evidence / static_cast<double>(shapes_.size())) / 5;
    for (Classification& shape : shapes_) shape = read_as(shape.letter, 5, sure);
    for (int column = 10; column < 10 + contradicted; ++column)
      show(9, column, (pattern_.array.at(9, column) + 1 + column % 3) % 5);
    return decode()[grid_.node_at(11, 20)].status != RegionStatus::kNoCodeword;
  };
  for (const int contradicted : {0, 1, 6}) {
    double too_little = 10, enough = 60;
    while (enough - too_little > 0.01) {
      const double between = 0.5 * (enough + too_little);
      (is_accepted(contradicted, between) ? enough : too_little) = between;
    }
    const double rim = contradicted == 0 ? 0 : 3 + 0.1 * (contradicted - 1);
    const double needed = std::log(kHigh * kWide + contradicted) + rim + std::log(kWholeRows * kWholeColumns) +
                          std::log(kHigh * kWide / kWrongCellsMax);
    EXPECT_NEAR(enough, needed, 0.1) << contradicted;
  }
}

/// What becomes of a symbol in a sheet's midst whose letter nothing says, so far off its line and from its letter.
class IslandsWithAWornSymbol : public test::ShownIslands {
 protected:
  CellClaim claim_of(double off_px, float distance) {
    grid_ = {}, shapes_.clear();
    show_pattern(10, 10, 20, 30);
    const std::int32_t node = grid_.node_at(15, 20);
    shapes_[node].log_probability.fill(-std::log(5.F) + 0.01F);
    shapes_[node].letter = static_cast<std::int8_t>((shapes_[node].letter + 1) % 5);  // so no window names it
    shapes_[node].distance = distance;
    auto segments = lines_through(2000, [](int) { return 0; });
    segments[node] = line_below(15, 20, off_px);
    return decode(segments)[node];
  }
};

TEST_F(IslandsWithAWornSymbol, HoldItBesideItsLine) {
  const CellClaim claim = claim_of(3, 4);
  EXPECT_TRUE(claim.same_cell(15, 20));
  EXPECT_EQ(claim.status, RegionStatus::kOffEpipolarLine);  // its own point would be wrong
}

TEST_F(IslandsWithAWornSymbol, DoNotHoldItFarFromItsLine) {
  EXPECT_FALSE(claim_of(6, 4).named());
}

TEST_F(IslandsWithAWornSymbol, DoNotHoldAWholeOneThatIsOffItsLine) {
  EXPECT_FALSE(claim_of(3, 1).named());
}

TEST_F(Islands, AreBothRefusedWhereTheyShowOnePartOfThePattern) {
  for (int row = 0; row < 8; ++row) {
    for (int column = 0; column < 8; ++column) {
      show(row, column, pattern_.array.at(20 + row, 30 + column));
      show(row, column + 20, pattern_.array.at(20 + row, 30 + column));
    }
  }
  for (const CellClaim& claim : decode()) EXPECT_EQ(claim.status, RegionStatus::kDuplicateCell);
}

TEST_F(Islands, AreNotOneMistakeAwayFromNothing) {
  show_pattern(10, 10, 18, 18);
  shapes_[grid_.node_at(14, 14)] = read_as((pattern_.array.at(14, 14) + 1) % 5, 5, kSure);
  const auto claims = decode();
  EXPECT_EQ(claims[grid_.node_at(14, 14)].status, RegionStatus::kClassDisagrees);
  EXPECT_GE(decoded(claims), 48);
}

TEST_F(Islands, SayThatTheyLieOffTheirEpipolarLines) {
  show_pattern(10, 10, 20, 30);
  const std::vector<EpipolarSegment> nowhere(grid_.nodes.size());
  for (const CellClaim& claim : decode(nowhere)) EXPECT_EQ(claim.status, RegionStatus::kOffEpipolarLine);
}

TEST_F(Islands, LoseTheNodesThatOneLinkAloneHolds) {
  show_pattern(10, 10, 18, 18);
  show(12, 18, pattern_.array.at(12, 18));
  show(12, 19, pattern_.array.at(12, 19));
  const auto claims = decode();
  EXPECT_EQ(decoded(claims), 64);
  EXPECT_EQ(claims[grid_.node_at(12, 19)].status, RegionStatus::kNeighboursDisagree);
}

// Two above a sheet hold each other, until what is beside them is plainly of something else.
TEST_F(Islands, LoseWhatLiesBesideAPlainContradiction) {
  const auto keep_beside = [&](float ratio) {
    grid_ = {}, shapes_.clear();
    show_pattern(10, 10, 20, 30);
    show_pattern(9, 20, 10, 22);
    show(9, 19, (pattern_.array.at(9, 19) + 1) % 5);
    shapes_.back().log_probability[pattern_.array.at(9, 19)] = ratio - std::log(5.F);
    const auto claims = decode();
    return is_decoded(claims, 9, 20) && is_decoded(claims, 9, 21);
  };
  EXPECT_TRUE(keep_beside(-1.4F));
  EXPECT_FALSE(keep_beside(-1.6F));
}

TEST_F(Islands, AreTheSameInWhateverOrderNodesStand) {
  std::mt19937 random(6);
  show_pattern(10, 10, 25, 40);
  show_pattern(25, 10, 26, 40, 3);
  show_pattern(26, 10, 35, 40);
  for (Classification& shape : shapes_)
    if (random() % 12 == 0) shape = read_as(static_cast<int>(random() % 5), 5, kSure);
  const auto claims = decode();
  std::vector<std::size_t> order(shapes_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (int round = 0; round < 3; ++round) {
    std::shuffle(order.begin(), order.end(), random);
    SimulatedGrid grid;
    std::vector<Classification> shapes;
    for (const std::size_t i : order) {
      const auto [row, column] = grid_.cells[i];
      grid.add(row, column, grid_.nodes[i].centre_px, LatticeFrame::Identity());
      shapes.push_back(shapes_[i]);
    }
    std::swap(grid, grid_), std::swap(shapes, shapes_);
    const auto shuffled = decode();
    std::swap(grid, grid_), std::swap(shapes, shapes_);
    for (std::size_t k = 0; k < order.size(); ++k) {
      EXPECT_EQ(shuffled[k].status, claims[order[k]].status) << k;
      EXPECT_EQ(shuffled[k].row, claims[order[k]].row);
      EXPECT_EQ(shuffled[k].column, claims[order[k]].column);
    }
  }
}

// Every window of an array whose right half is its left one again answers to two cells.
TEST_F(Islands, AreNoneWhereEveryWindowAnswersToTwoCells) {
  for (int row = 0; row < kWholeRows; ++row)
    for (int column = 0; column < 35; ++column)
      pattern_.array.cells[row * pattern_.array.columns + column + 35] =
          pattern_.array.cells[row * pattern_.array.columns + column];
  pattern_.array.minimum_distance = 0;
  show_pattern(0, 0, 40, 34);
  EXPECT_EQ(decoded(decode()), 0);
}

}  // namespace
}  // namespace slsd
