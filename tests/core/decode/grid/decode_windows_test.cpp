// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/grid/decode_windows.hpp"

#include <cmath>
#include <optional>
#include <random>

#include <gmock/gmock.h>

#include "tests/core/decode/alone.hpp"
#include "tests/core/decode/grid/simulated_grid.hpp"
#include "tests/core/decode/shipped_pattern.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

struct Damage {
  double misread = 0, missing = 0;
  std::uint32_t seed = 1;
};

/// A grid that is linked without fault, and what is read of its symbols.
struct Sheet {
  SimulatedGrid grid;
  std::vector<Classification> shapes;
  std::vector<bool> misread;
};

Sheet sheet_of(const CodeArray& array, const Damage& damage) {
  std::mt19937 random(damage.seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  Sheet sheet;
  for (int row = 0; row < kWholeRows; ++row) {
    for (int column = 0; column < kWholeColumns; ++column) {
      if (uniform(random) < damage.missing) continue;
      sheet.misread.push_back(uniform(random) < damage.misread);
      const int change = sheet.misread.back() ? 1 + static_cast<int>(random() % (array.letters - 1)) : 0;
      sheet.grid.add(row, column, {18.F * static_cast<float>(column), 18.F * static_cast<float>(row)},
                     LatticeFrame::Identity());
      sheet.shapes.push_back(read_as((array.at(row, column) + change) % array.letters, array.letters, 0.96));
    }
  }
  sheet.grid.link_truly();
  return sheet;
}

/// With five letters and minimum distance three, as shipped.
class DecodeWindows : public testing::Test {
 protected:
  DecodeWindows()
      : pattern_(shipped_pattern("16px-5.toml")), cells_(pattern_, flat_prototypes(), paper_rig().projector) {}

  std::vector<CellClaim> decode(const Sheet& sheet, std::span<const EpipolarSegment> segments = {}) {
    WindowDecoder decoder(pattern_, std::make_shared<const Codebook>(pattern_.array, kWholeRows, kWholeColumns),
                          kWrongCellsMax);
    std::vector<CellClaim> claims;
    decoder.decode(sheet.grid.nodes, sheet.shapes, CellGate(cells_, segments, 1.5), alone, claims);
    return claims;
  }

  struct Score {
    int nodes = 0, named = 0, decoded = 0, wrong = 0;
  };
  static Score score(const Sheet& sheet, const std::vector<CellClaim>& claims) {
    Score score;
    for (std::size_t i = 0; i < claims.size(); ++i) {
      const bool right = claims[i].same_cell(sheet.grid.cells[i].first, sheet.grid.cells[i].second);
      ++score.nodes;
      score.named += right;
      score.decoded += claims[i].status == RegionStatus::kDecoded;
      score.wrong += claims[i].status == RegionStatus::kDecoded && !right;
    }
    return score;
  }

  Pattern pattern_;
  CellRays cells_;
};

TEST_F(DecodeWindows, NamesEveryNodeOfAWholeGrid) {
  const Sheet sheet = sheet_of(pattern_.array, {});
  const Score result = score(sheet, decode(sheet));
  EXPECT_EQ(result.nodes, kWholeRows * kWholeColumns);
  EXPECT_EQ(result.decoded, result.nodes);
  EXPECT_EQ(result.wrong, 0);
}

TEST_F(DecodeWindows, SurvivesMisreadAndMissingSymbols) {
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    const Sheet sheet = sheet_of(pattern_.array, {.misread = 0.02, .missing = 0.2, .seed = seed});
    const Score result = score(sheet, decode(sheet));
    EXPECT_GE(result.named, 0.95 * result.nodes) << seed;
    EXPECT_EQ(result.wrong, 0) << seed;
  }
}

TEST_F(DecodeWindows, KeepsMostWhereAFifthIsMissing) {
  const Sheet sheet = sheet_of(pattern_.array, {.missing = 0.2});
  const Score result = score(sheet, decode(sheet));
  EXPECT_GE(result.decoded, 0.95 * result.nodes);  // the others hang by one link, or by none
  EXPECT_EQ(result.wrong, 0);
}

TEST_F(DecodeWindows, SurvivesATenthMisread) {
  const Sheet sheet = sheet_of(pattern_.array, {.misread = 0.1});
  const Score result = score(sheet, decode(sheet));
  EXPECT_GE(result.named, 0.96 * result.nodes);
  EXPECT_EQ(result.wrong, 0);
}

TEST_F(DecodeWindows, RejectsASymbolThatIsNotThatOfItsCell) {
  const Sheet sheet = sheet_of(pattern_.array, {.misread = 0.02});
  const auto claims = decode(sheet);
  int misread = 0;
  for (std::size_t i = 0; i < claims.size(); ++i) {
    if (!sheet.misread[i]) continue;
    ++misread;
    EXPECT_EQ(claims[i].status, RegionStatus::kClassDisagrees);
  }
  EXPECT_GT(misread, 30);
}

TEST_F(DecodeWindows, RejectsAShapeThatIsNoLetter) {
  Sheet sheet = sheet_of(pattern_.array, {});
  const std::int32_t odd = sheet.grid.node_at(20, 30);
  sheet.shapes[odd].letter = -1;
  const auto claims = decode(sheet);
  EXPECT_EQ(claims[odd].status, RegionStatus::kUnknownShape);
  EXPECT_TRUE(claims[odd].same_cell(20, 30));
  EXPECT_EQ(claims[sheet.grid.node_at(20, 31)].status, RegionStatus::kDecoded);
}

// Without the epipolar line one random codeword in twenty is one letter from some window.
TEST_F(DecodeWindows, NamesHardlyAnythingOfAnotherArray) {
  CodeArray other = pattern_.array;
  std::mt19937 random(8);
  for (std::uint8_t& letter : other.cells) letter = static_cast<std::uint8_t>(random() % 5);
  const Sheet sheet = sheet_of(other, {});
  EXPECT_LT(score(sheet, decode(sheet)).decoded, kWholeRows * kWholeColumns / 20);
}

TEST_F(DecodeWindows, SaysWhyLonelyNodesHaveNoCell) {
  Sheet sheet = sheet_of(pattern_.array, {});
  for (GridNode& node : sheet.grid.nodes) node.links = {-1, -1, -1, -1};
  for (const CellClaim& claim : decode(sheet)) {
    EXPECT_EQ(claim.status, RegionStatus::kNoNeighbour);
    EXPECT_FALSE(claim.named());
  }
}

TEST_F(DecodeWindows, OfNoNodesIsNothing) {
  EXPECT_THAT(decode({}), testing::IsEmpty());
}

TEST_F(DecodeWindows, TakesNoCellThatTheGateExcludes) {
  const Sheet sheet = sheet_of(pattern_.array, {});
  // An empty segment to each node: nothing of the working range is lit.
  const std::vector<EpipolarSegment> nowhere(sheet.grid.nodes.size());
  for (const CellClaim& claim : decode(sheet, nowhere)) EXPECT_EQ(claim.status, RegionStatus::kOffEpipolarLine);
}

TEST_F(DecodeWindows, NamesAPartThatIsAskedForAlone) {
  const Sheet sheet = sheet_of(pattern_.array, {});
  WindowDecoder decoder(pattern_, std::make_shared<const Codebook>(pattern_.array, 20, 30), kWrongCellsMax);
  std::vector<CellClaim> claims;
  decoder.decode(sheet.grid.nodes, sheet.shapes, CellGate(cells_, {}, 1.5), alone, claims);
  EXPECT_EQ(score(sheet, claims).decoded, 20 * 30);
  EXPECT_EQ(score(sheet, claims).wrong, 0);
}

}  // namespace
}  // namespace slsd
