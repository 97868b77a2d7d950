// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/grid/islands.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include "core/decode/grid/decode_windows.hpp"
#include "tests/core/decode/alone.hpp"
#include "tests/core/decode/shipped_pattern.hpp"
#include "tests/core/decode/simulated_grid.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

constexpr double kSure = 0.992;

/// Nodes at places of a grid, linked wherever there are two side by side, that show what they are told to.
class Islands : public testing::Test {
 protected:
  Islands() : pattern_(shipped_pattern("16px-5.toml")), cells_(pattern_, flat_prototypes(), paper_rig().projector) {}

  void show(int row, int column, int letter) {
    grid_.add(row, column, {18.F * static_cast<float>(column), 18.F * static_cast<float>(row)},
              LatticeFrame::Identity());
    shapes_.push_back(read_as(letter, 5, kSure));
  }
  void show_pattern(int top, int left, int bottom, int right, int slid = 0) {
    for (int row = top; row < bottom; ++row)
      for (int column = left; column < right; ++column) show(row, column, pattern_.array.at(row, column + slid));
  }

  /// The line of each node's pixel, were the cells at one depth, those of a row as many columns on as it is slid.
  std::vector<EpipolarSegment> lines_through(double depth_mm, const std::function<int(int)>& slid) const {
    const Calibration rig = paper_rig();
    const RigidTransform& to_projector = rig.cameras[0].projector_from_camera;
    const EpipolarGate gate(rig.cameras[0], rig.projector, 350, 3200);
    std::vector<EpipolarSegment> segments;
    for (const auto& [row, column] : grid_.cells) {
      const Eigen::Vector3d point = depth_mm * cells_.ray(row, column + slid(row)).direction.homogeneous();
      const Eigen::Vector3d seen = to_projector.rotation.transpose() * (point - to_projector.translation);
      segments.push_back(gate.prepare(seen.hnormalized()));
    }
    return segments;
  }
  /// The line of what is seen so far below a cell's middle, projector px.
  EpipolarSegment line_below(int row, int column, double off_px) const {
    const Calibration rig = paper_rig();
    const RigidTransform& to_projector = rig.cameras[0].projector_from_camera;
    const Eigen::Vector2d pixel = cells_.pixel(row, column) + Eigen::Vector2d(0, off_px);
    const Eigen::Vector3d point = 2000 * rig.projector.undistort(pixel).homogeneous();
    return EpipolarGate(rig.cameras[0], rig.projector, 350, 3200)
        .prepare((to_projector.rotation.transpose() * (point - to_projector.translation)).hnormalized());
  }
  std::vector<CellClaim> decode(std::span<const EpipolarSegment> segments = {}) {
    grid_.link_truly();
    WindowDecoder decoder(pattern_, std::make_shared<const Codebook>(pattern_.array, kWholeRows, kWholeColumns),
                          kWrongCellsMax);
    std::vector<CellClaim> claims;
    decoder.decode(grid_.nodes, shapes_, CellGate(cells_, segments, 1.5), alone, claims);
    return claims;
  }
  int decoded(const std::vector<CellClaim>& claims) const {
    return static_cast<int>(std::ranges::count(claims, RegionStatus::kDecoded, &CellClaim::status));
  }
  bool is_decoded(const std::vector<CellClaim>& claims, int row, int column) const {
    return claims[grid_.node_at(row, column)].status == RegionStatus::kDecoded;
  }

  Pattern pattern_;
  CellRays cells_;
  SimulatedGrid grid_;
  std::vector<Classification> shapes_;
};

TEST_F(Islands, NeedEvidenceForTheBudgetWhereTheyMayLieAnywhere) {
  show_pattern(10, 10, 13, 13);  // nine letters are e^14 to 1, and there are 3124 places
  EXPECT_EQ(decoded(decode()), 0);
  show_pattern(20, 30, 24, 35);
  EXPECT_EQ(decoded(decode()), 20);
}

// The sum in docs/decoder.md. A strip is as sure of its letters as just makes it an island, beneath some other letters.
TEST_F(Islands, NeedTheEvidenceThatTheirRimCosts) {
  constexpr int kRows = 3, kColumns = 20;
  const auto is_accepted = [&](int contradicted, double evidence) {
    grid_ = {}, shapes_.clear();
    show_pattern(10, 10, 10 + kRows, 10 + kColumns);
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
    const double needed = std::log(kRows * kColumns + contradicted) + rim + std::log(kWholeRows * kWholeColumns) +
                          std::log(kRows * kColumns / kWrongCellsMax);
    EXPECT_NEAR(enough, needed, 0.1) << contradicted;
  }
}

TEST_F(Islands, AreNoLargerForNodesThatChanceAddsAtTheirRim) {
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

// Two rows at one depth named the row between them, wherever its letters agreed.
TEST_F(Islands, NameNoRowBetweenThemThatIsAtAnotherDepth) {
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

TEST_F(Islands, NameNoSevenOfARowBetweenThemThatAgreeByChance) {
  show_pattern(10, 10, 20, 50);
  show_pattern(20, 10, 21, 27, 3);
  show_pattern(20, 27, 21, 34);
  show_pattern(20, 34, 21, 50, 3);
  show_pattern(21, 10, 30, 50);
  const auto claims = decode();
  for (int column = 27; column < 34; ++column) EXPECT_FALSE(is_decoded(claims, 20, column)) << column;
}

// Letters that come again some columns on: as many as chance never brings agree with the row of another depth.
TEST_F(Islands, NameNothingThatARowSlidAlongItsLineExplainsBetter) {
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
TEST_F(Islands, LookForARowSlidWhereALetterIsUnlikely) {
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
TEST_F(Islands, NameNoRowThatItsOwnLettersElsewhereExplainAsWell) {
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

TEST_F(Islands, LoseNothingAtAStraightEdgeInDepth) {
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

TEST_F(Islands, KeepThinBandsWhoseLettersAllAgree) {
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
class PatchedIslands : public Islands {
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

TEST_F(PatchedIslands, GiveUpWhatIsBesideAWellSeenContradiction) {
  put(25, 30, 1);
  const auto claims = decode();
  for (const auto& [row, column] : {std::pair(24, 30), {26, 30}, {25, 29}, {25, 31}})
    EXPECT_FALSE(is_decoded(claims, row, column)) << row << ", " << column;
  EXPECT_TRUE(is_decoded(claims, 23, 30));
  EXPECT_TRUE(is_decoded(claims, 25, 28));
}

/// Four symbols at a rim, below which letters of something else lie, moved along their rows.
class IslandsAtAnEdge : public Islands {
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

/// Below a sheet some of a row, moved along its line, a third of whose symbols are anyone's guess.
class IslandsAboveAShortRow : public Islands {
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

/// What becomes of a symbol in a sheet's midst whose letter nothing says, so far off its line and from its letter.
class IslandsWithAWornSymbol : public Islands {
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

/// What becomes of a row in a sheet's midst whose letters are right and lie so far off their lines.
class IslandsWithARowOffItsLines : public Islands {
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

/// A surface whose last columns come closer together, each by so much, up to where its links break.
class IslandsThatTurnAway : public Islands {
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
