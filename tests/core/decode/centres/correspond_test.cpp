// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/correspond.hpp"

#include <algorithm>
#include <initializer_list>
#include <string>

#include <gmock/gmock.h>

#include "tests/core/decode/alone.hpp"
#include "tests/core/decode/grid/simulated_grid.hpp"
#include "tests/core/decode/shipped_pattern.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

constexpr auto kDecoded = RegionStatus::kDecoded;
constexpr auto kDuplicate = RegionStatus::kDuplicateCell;

class Correspond : public testing::Test {
 protected:
  Correspond()
      : rig_(paper_rig()),
        pattern_(shipped_pattern("16px-5.toml")),
        cells_(pattern_, flat_prototypes(), rig_.projector),
        gate_(rig_.cameras[0], rig_.projector, 1500, 2500) {}

  /// A claim on a cell by what the camera sees of `lit` on a plane.
  void add(int lit_row, int lit_column, int row, int column, float evidence = 20, double depth_mm = 2000) {
    const Surface wall = plane({0, 0, depth_mm}, {0, 0, 1});
    const auto seen = camera_from_projector(cells_.pixel(lit_row, lit_column), rig_, wall);
    ASSERT_TRUE(seen);
    segments_.push_back(gate_.prepare(rig_.cameras[0].lens.undistort(*seen)));
    claims_.push_back({static_cast<std::int16_t>(row), static_cast<std::int16_t>(column), evidence, kDecoded});
  }

  std::vector<RegionStatus> statuses() {
    Correspondence({}).correspond(cells_, segments_, 1.5, alone, claims_);
    std::vector<RegionStatus> result;
    for (const CellClaim& claim : claims_) result.push_back(claim.status);
    return result;
  }

  Calibration rig_;
  Pattern pattern_;
  CellRays cells_;
  EpipolarGate gate_;
  std::vector<EpipolarSegment> segments_;
  std::vector<CellClaim> claims_;
};

TEST_F(Correspond, KeepsWhatIsRight) {
  for (int row = 2; row < 42; row += 5) {
    for (int column = 3; column < 68; column += 7) add(row, column, row, column);
  }
  EXPECT_THAT(statuses(), testing::Each(kDecoded));
}

TEST_F(Correspond, RejectsACellOffTheEpipolarLine) {
  add(20, 30, 21, 30);
  add(20, 30, 19, 30);
  EXPECT_THAT(statuses(), testing::Each(RegionStatus::kOffEpipolarLine));
}

TEST_F(Correspond, RejectsACellOutOfTheDepthRange) {
  add(20, 30, 20, 30, 20, 1400);
  add(10, 40, 10, 40, 20, 2600);
  add(30, 35, 30, 35, 20, 1600);
  EXPECT_THAT(statuses(),
              testing::ElementsAre(RegionStatus::kOutOfDepthRange, RegionStatus::kOutOfDepthRange, kDecoded));
}

TEST_F(Correspond, GivesACellToTheClearlyBetterClaim) {
  add(20, 30, 20, 30, 12);
  add(20, 30, 20, 30, 20);
  add(10, 10, 10, 10, 20);
  add(10, 10, 10, 10, 12);
  EXPECT_THAT(statuses(), testing::ElementsAre(kDuplicate, kDecoded, kDecoded, kDuplicate));
}

TEST_F(Correspond, GivesACellToNeitherOfTwoClaimsAlikeGood) {
  add(20, 30, 20, 30, 20);
  add(20, 30, 20, 30, 18.5F);
  EXPECT_THAT(statuses(), testing::Each(kDuplicate)) << "less than two apart";
  claims_.clear(), segments_.clear();
  add(20, 30, 20, 30, 20);
  add(20, 30, 20, 30, 17.5F);
  EXPECT_THAT(statuses(), testing::ElementsAre(kDecoded, kDuplicate));
}

TEST_F(Correspond, SettlesThreeClaimsInAnyOrder) {
  const float evidence[3] = {10, 20, 11};
  for (const auto& order : {std::array{0, 1, 2}, {1, 0, 2}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 2, 0}}) {
    claims_.clear(), segments_.clear();
    for (const int i : order) add(20, 30, 20, 30, evidence[i]);
    const auto settled = statuses();
    for (int i = 0; i < 3; ++i) EXPECT_EQ(settled[i], order[i] == 1 ? kDecoded : kDuplicate);
  }
}

TEST_F(Correspond, WeighsNoClaimThatTheLineRejected) {
  add(20, 30, 20, 30, 12);
  add(22, 30, 20, 30, 20);
  EXPECT_THAT(statuses(), testing::ElementsAre(kDecoded, RegionStatus::kOffEpipolarLine));
}

TEST_F(Correspond, LeavesEarlierReasonsAlone) {
  add(20, 30, 20, 30);
  claims_[0].status = RegionStatus::kClassDisagrees;
  EXPECT_THAT(statuses(), testing::ElementsAre(RegionStatus::kClassDisagrees));
}

/// A sheet of 6 rows of nodes, all decoded; below it a row of another surface. The frame goes on all around it.
struct RimSheet {
  SimulatedGrid grid;
  std::vector<CellClaim> claims;
  std::vector<Classification> shapes;  // whole
  Eigen::Vector2f frame_px{400, 400};

  explicit RimSheet(int columns = 9) {
    for (int row = 0; row < 7; ++row) {
      for (int column = 0; column < columns; ++column) {
        grid.add(row, column, through(Eigen::Affine2f(Eigen::Translation2f(100, 100)).matrix(), row, column),
                 LatticeFrame::Identity());
        claims.push_back({static_cast<std::int16_t>(row), static_cast<std::int16_t>(row < 6 ? column : column + 20), 0,
                          kDecoded, row < 6 ? 0 : 1, GridFit::kLoose});
      }
    }
    grid.link_truly();
    Classification whole;
    whole.letter = 0;
    shapes.assign(claims.size(), whole);
  }
  /// @param distance  from its letter, standard deviations
  void damage(int row, int column, float distance) {
    shapes[grid.node_at(row, column)].distance = distance;
    at(row, column).status = RegionStatus::kDamagedShape;
  }
  CellClaim& at(int row, int column) { return claims[grid.node_at(row, column)]; }
  void refuse_lone() { Correspondence({}).refuse_lone(grid.nodes, shapes, frame_px, alone, claims); }
};

TEST(RefuseLone, RefusesWhatStandsBetweenRefusedOnesAtARim) {
  RimSheet sheet;
  for (const int column : {0, 1, 2, 3, 5, 6, 8}) sheet.at(5, column).status = RegionStatus::kDamagedShape;
  sheet.refuse_lone();
  EXPECT_EQ(sheet.at(5, 4).status, RegionStatus::kNeighboursDisagree);
  EXPECT_EQ(sheet.at(5, 7).status, RegionStatus::kNeighboursDisagree);
  for (int column = 0; column < 9; ++column) EXPECT_EQ(sheet.at(4, column).status, kDecoded);
}

TEST(RefuseLone, LeavesWhatFitsTheGridTightly) {
  for (const GridFit fit : {GridFit::kNone, GridFit::kLoose, GridFit::kTight}) {
    RimSheet sheet;
    for (const int row : {1, 2, 3}) sheet.at(row, 8).status = RegionStatus::kClassDisagrees;
    sheet.at(4, 8).grid_fit = sheet.at(5, 8).grid_fit = fit;
    sheet.refuse_lone();
    EXPECT_EQ(sheet.at(4, 8).status, fit == GridFit::kTight ? kDecoded : RegionStatus::kNeighboursDisagree);
  }
}

TEST(RefuseLone, RefusesTheLastOfARefusedRow) {
  RimSheet sheet;
  for (const int column : {0, 4, 5, 6, 7, 8}) sheet.at(5, column).status = RegionStatus::kClassDisagrees;
  sheet.refuse_lone();
  for (const int column : {1, 2, 3}) EXPECT_EQ(sheet.at(5, column).status, RegionStatus::kNeighboursDisagree) << column;
}

// What goes first may be what another stood with.
TEST(RefuseLone, RefusesAllThatIsLeftOfARow) {
  RimSheet sheet;
  for (const int column : {1, 2, 3, 5, 6, 8}) sheet.at(2, column).status = RegionStatus::kDamagedShape;
  sheet.at(1, 7) = sheet.at(6, 7);
  sheet.refuse_lone();
  EXPECT_EQ(sheet.at(2, 7).status, RegionStatus::kNeighboursDisagree);
  EXPECT_EQ(sheet.at(2, 4).status, RegionStatus::kNeighboursDisagree);
}

// Some that agree by chance, where the frame ends.
TEST(RefuseLone, RefusesTheFewThatAreLeftOfAMisreadRow) {
  RimSheet sheet;
  for (int column = 0; column < 7; ++column) sheet.at(1, column).status = RegionStatus::kClassDisagrees;
  sheet.at(2, 2).status = RegionStatus::kDamagedShape;
  for (const int column : {4, 5, 6}) sheet.at(2, column).status = RegionStatus::kClassDisagrees;
  sheet.refuse_lone();
  for (const int column : {0, 1, 3}) EXPECT_EQ(sheet.at(2, column).status, RegionStatus::kNeighboursDisagree) << column;
  for (int column = 0; column < 9; ++column) EXPECT_EQ(sheet.at(3, column).status, kDecoded) << column;
}

// An edge along the row tears what has other letters above it than below; what has the same looks whole.
TEST(RefuseLone, RefusesTheFewBetweenTornOnes) {
  for (const bool is_torn : {false, true}) {
    RimSheet sheet;
    for (int column = 0; column < 9; ++column) sheet.at(1, column).status = RegionStatus::kClassDisagrees;
    for (const int column : {0, 5, 8}) sheet.damage(2, column, is_torn ? 6.1F : 5.9F);
    sheet.refuse_lone();
    for (const int column : {1, 2, 3, 4}) EXPECT_EQ(sheet.at(2, column).status, kDecoded) << column;
    for (const int column : {6, 7}) EXPECT_EQ(sheet.at(2, column).status == kDecoded, !is_torn) << column;
  }
}

TEST(RefuseLone, RefusesWhatStandsBetweenTornOnesWhoseLinksAreBroken) {
  for (const bool is_torn : {false, true}) {
    RimSheet sheet;
    for (const int column : {0, 1, 2, 3, 5, 6, 7, 8}) sheet.damage(2, column, is_torn ? 6.1F : 5.9F);
    GridNode& node = sheet.grid.nodes[sheet.grid.node_at(2, 4)];
    node.broken[kLeft] = node.broken[kRight] = true;
    sheet.refuse_lone();
    EXPECT_EQ(sheet.at(2, 4).status == kDecoded, !is_torn);
  }
}

// One of them has nothing above it, and a broken link ends what was refused.
TEST(RefuseLone, RefusesTheFewThatAreLeftOfABrokenRow) {
  RimSheet sheet;
  for (int column = 0; column < 9; ++column) sheet.at(1, column).status = RegionStatus::kClassDisagrees;
  for (const int column : {4, 5, 6}) {
    sheet.at(2, column).status = RegionStatus::kNeighboursDisagree;
    sheet.grid.nodes[sheet.grid.node_at(3, column)].links[kUp] = -1;
  }
  sheet.grid.nodes[sheet.grid.node_at(2, 5)].broken[kLeft] = true;
  sheet.grid.nodes[sheet.grid.node_at(2, 7)].links[kUp] = -1;
  sheet.refuse_lone();
  for (const int column : {7, 8}) EXPECT_EQ(sheet.at(2, column).status, RegionStatus::kNeighboursDisagree) << column;
  for (int column = 0; column < 9; ++column) EXPECT_EQ(sheet.at(3, column).status, kDecoded) << column;
}

/// What is left of a sheet's first row: its symbols, from the left, are whole (w), torn (t), damaged but no more (d),
/// misread (m) or of no cell (n); a bar parts two lines, a stroke breaks a link.
std::string left_of(const std::string& first_row, GridFit fit = GridFit::kLoose) {
  const auto columns = static_cast<int>(std::ranges::count_if(first_row, [](char c) { return c != '|' && c != '/'; }));
  RimSheet sheet(columns);
  int column = 0;
  for (const char symbol : first_row) {
    if (symbol == '|' || symbol == '/') {
      GridNode &before = sheet.grid.nodes[sheet.grid.node_at(0, column - 1)],
               &after = sheet.grid.nodes[sheet.grid.node_at(0, column)];
      if (symbol == '|') before.links[kRight] = after.links[kLeft] = -1;
      before.broken[kRight] = after.broken[kLeft] = symbol == '/';
      continue;
    }
    sheet.at(0, column).grid_fit = fit;
    if (symbol == 't') sheet.damage(0, column, 6.1F);
    if (symbol == 'd') sheet.damage(0, column, 5.9F);
    if (symbol == 'm') sheet.at(0, column).status = RegionStatus::kClassDisagrees;
    if (symbol == 'n') sheet.at(0, column) = {};
    ++column;
  }
  sheet.refuse_lone();
  std::string left;
  for (column = 0; column < columns; ++column) {
    left += sheet.at(0, column).status == kDecoded ? 'w' : '.';
    EXPECT_EQ(sheet.at(1, column).status, kDecoded) << first_row << ", " << column;
  }
  return left;
}

// What an edge along the row leaves whole has the same letter on both sides of it, whichever of them is the island's.
TEST(RefuseLone, RefusesWhatAnEdgeAlongItsRowLeavesWhole) {
  EXPECT_EQ(left_of("nnwwwwnnn"), ".........");
  EXPECT_EQ(left_of("mmwwwwmmm"), ".........");
  EXPECT_EQ(left_of("ddwwwwddd"), "..wwww...") << "what is damaged is of no other surface";
  EXPECT_EQ(left_of("nnwwwwwnn"), "..wwwww..") << "fewer are torn than are whole";
  EXPECT_EQ(left_of("nnwwwwnnn", GridFit::kTight), "..wwww...");
  EXPECT_EQ(left_of("nnnww|wwww"), "...wwwwww") << "three are too few";
  EXPECT_EQ(left_of("nnnnww|www"), "......www");
}

// Two beside each other stand in both of two torn rows; each has one that stands above it and below.
TEST(RefuseLone, RefusesABlockOverTwoTornRows) {
  const auto standing = [](bool both_torn, GridFit fit_of_upper) {
    RimSheet sheet(10);
    for (const int row : {2, 3})
      for (const int column : {0, 1, 2, 3, 6, 7, 8, 9})
        if (row == 2 || both_torn) sheet.at(row, column) = {};
    for (const int column : {4, 5}) sheet.at(2, column).grid_fit = fit_of_upper;
    sheet.refuse_lone();
    std::string rows;
    for (const int row : {2, 3}) rows += sheet.at(row, 4).status == kDecoded ? 'w' : '.';
    return rows;
  };
  EXPECT_EQ(standing(true, GridFit::kLoose), "..");
  EXPECT_EQ(standing(true, GridFit::kTight), "ww");
  EXPECT_EQ(standing(false, GridFit::kLoose), "ww") << "one row may be print";
}

TEST(RefuseLone, LooksBeyondBrokenLinksAtWhatIsTornOrHasNoCell) {
  EXPECT_EQ(left_of("nnn/wwww/nnn", GridFit::kNone), "..........");
  EXPECT_EQ(left_of("mmm/wwww/mmm", GridFit::kNone), "...wwww...");
  EXPECT_EQ(left_of("nnn/wwww/nnn"), "...wwww...");
  EXPECT_EQ(left_of("ttttt/wwww/ttttt"), "..............");
}

TEST(RefuseLone, CountsHalfWhatIsTornButOfItsCellsLetter) {
  EXPECT_EQ(left_of("ttttwwwttt"), "....www...");
  EXPECT_EQ(left_of("ttttwwwtttt"), "...........");
  EXPECT_EQ(left_of("ttttwwwwtttt"), "....wwww....");
}

TEST(RefuseLone, LooksEightSymbolsAlongATornRow) {
  EXPECT_EQ(left_of("wwddddnnnn"), "w.........") << "from the first three are seen";
}

// One symbol of a row of another surface, which joins the rows above to those below.
TEST(RefuseLone, RefusesABridgeOverARefusedRow) {
  RimSheet sheet;
  for (const int column : {0, 1, 2, 3, 5, 6, 7, 8}) sheet.at(2, column).status = RegionStatus::kNoCodeword;
  sheet.grid.nodes[sheet.grid.node_at(2, 5)].broken[kRight] = true;
  sheet.refuse_lone();
  EXPECT_EQ(sheet.at(2, 4).status, RegionStatus::kNeighboursDisagree);
}

TEST(RefuseLone, RefusesABridgeOverATornRow) {
  const auto stands = [](std::initializer_list<int> torn, GridFit fit) {
    RimSheet sheet(10);
    for (const int column : {0, 1, 2, 3, 5, 6, 7, 8, 9})
      sheet.damage(2, column, std::ranges::find(torn, column) == torn.end() ? 5.9F : 6.1F);
    GridNode& node = sheet.grid.nodes[sheet.grid.node_at(2, 4)];
    node.broken[kLeft] = node.broken[kRight] = true;
    sheet.at(2, 4).grid_fit = fit;
    sheet.refuse_lone();
    return sheet.at(2, 4).status == kDecoded;
  };
  EXPECT_TRUE(stands({3, 5}, GridFit::kNone));
  EXPECT_FALSE(stands({2, 3, 5}, GridFit::kNone));
  EXPECT_TRUE(stands({2, 3, 5, 9}, GridFit::kLoose)) << "four to each side are asked";
  EXPECT_FALSE(stands({0, 2, 3, 5}, GridFit::kLoose));
  EXPECT_TRUE(stands({0, 1, 2, 3, 5, 6, 7, 8}, GridFit::kTight));
}

TEST(RefuseLone, RefusesWhatHasNothingStandingBesideIt) {
  RimSheet sheet;
  sheet.at(0, 1).status = sheet.at(1, 0).status = RegionStatus::kDamagedShape;
  sheet.refuse_lone();
  EXPECT_EQ(sheet.at(0, 0).status, RegionStatus::kNeighboursDisagree);
  EXPECT_EQ(sheet.at(1, 1).status, kDecoded);
}

TEST(RefuseLone, RefusesTwoThatHaveNothingElseStandingBesideThem) {
  const auto standing = [](int left, GridFit fit_of_one) {
    RimSheet sheet;
    for (int column = 0; column < 9; ++column) sheet.at(1, column).status = RegionStatus::kDamagedShape;
    for (int column = left; column < 9; ++column) sheet.at(0, column).status = RegionStatus::kDamagedShape;
    sheet.at(0, 1).grid_fit = fit_of_one;
    sheet.refuse_lone();
    int count = 0;
    for (int column = 0; column < left; ++column) count += sheet.at(0, column).status == kDecoded;
    return count;
  };
  EXPECT_EQ(standing(2, GridFit::kLoose), 0);
  EXPECT_EQ(standing(2, GridFit::kNone), 0);
  EXPECT_EQ(standing(2, GridFit::kTight), 2);
  EXPECT_EQ(standing(3, GridFit::kLoose), 3);
}

// The corner of something that was put there agrees by chance.
TEST(RefuseLone, RefusesTheCornerOfWhatIsMisread) {
  RimSheet sheet;
  for (const auto& [row, column] : {std::pair(2, 5), std::pair(3, 4)})
    sheet.at(row, column).status = RegionStatus::kClassDisagrees;
  sheet.refuse_lone();
  EXPECT_EQ(sheet.at(2, 4).status, kDecoded) << "what lies between the two stands";
  sheet.at(3, 5).status = RegionStatus::kNoCodeword;
  sheet.refuse_lone();
  EXPECT_EQ(sheet.at(2, 4).status, RegionStatus::kNeighboursDisagree);
}

// The border of the frame cuts what is beyond, and nobody knows what it is.
TEST(RefuseLone, RefusesTheCornerWhereTheFrameEnds) {
  const float beyond_last = 100 + 8 * SimulatedGrid::kPitchPx + 12;  // less than the next one needs
  RimSheet sheet;
  for (int column = 0; column < 9; ++column)
    sheet.at(6, column).column = static_cast<std::int16_t>(column), sheet.at(6, column).island = 0;
  sheet.frame_px.x() = beyond_last;
  sheet.refuse_lone();
  EXPECT_EQ(sheet.at(3, 8).status, kDecoded) << "the rim goes on";
  EXPECT_EQ(sheet.at(0, 8).status, kDecoded) << "nothing was refused";
  sheet.at(2, 8).status = RegionStatus::kDamagedShape;
  sheet.refuse_lone();
  EXPECT_EQ(sheet.at(3, 8).status, kDecoded) << "what is damaged is not of something else";
  sheet.at(2, 8).status = RegionStatus::kClassDisagrees;
  const std::vector<CellClaim> misread = sheet.claims;
  sheet.refuse_lone();
  EXPECT_EQ(sheet.at(3, 8).status, RegionStatus::kNeighboursDisagree);
  sheet.claims = misread;
  sheet.at(2, 8) = {};
  sheet.refuse_lone();
  EXPECT_EQ(sheet.at(3, 8).status, RegionStatus::kNeighboursDisagree) << "what has none of the cells is something else";
  sheet.claims = misread;
  for (CellClaim& claim : sheet.claims) claim.column = static_cast<std::int16_t>(claim.column + 62);
  sheet.refuse_lone();
  EXPECT_EQ(sheet.at(3, 8).status, kDecoded) << "the pattern ends there";
}

/// The third row is its first, and of that two symbols are left, beside three that are damaged.
RimSheet two_left_at_a_rim() {
  RimSheet sheet;
  for (int column = 0; column < 9; ++column) sheet.grid.nodes[sheet.grid.node_at(2, column)].links[kUp] = -1;
  for (const int column : {2, 3, 4}) {
    sheet.at(2, column).status = RegionStatus::kDamagedShape;
    sheet.grid.nodes[sheet.grid.node_at(3, column)].links[kUp] = -1;
  }
  return sheet;
}

TEST(RefuseLone, RefusesTheFewThatAreLeftBesideAMisreadOne) {
  RimSheet sheet = two_left_at_a_rim();
  sheet.refuse_lone();
  for (const int column : {0, 1}) EXPECT_EQ(sheet.at(2, column).status, kDecoded) << column;
  sheet.at(2, 3).status = RegionStatus::kClassDisagrees;
  sheet.refuse_lone();
  for (const int column : {0, 1}) EXPECT_EQ(sheet.at(2, column).status, RegionStatus::kNeighboursDisagree) << column;
}

TEST(RefuseLone, RefusesTheFewThatAreLeftWhereTheFrameEnds) {
  RimSheet sheet = two_left_at_a_rim();
  for (GridNode& node : sheet.grid.nodes) node.centre_px.y() -= 100 + 2 * SimulatedGrid::kPitchPx - 12;
  sheet.refuse_lone();
  for (const int column : {0, 1}) EXPECT_EQ(sheet.at(2, column).status, RegionStatus::kNeighboursDisagree) << column;
  for (int column = 0; column < 9; ++column) EXPECT_EQ(sheet.at(3, column).status, kDecoded) << column;
}

// An edge that runs through a row breaks its links: what is beside a symbol then shows from the row within alone.
TEST(RefuseLone, LooksAlongTheRowWithinWhereTheRowIsBroken) {
  RimSheet sheet;
  for (int column = 0; column < 9; ++column) {
    const int node = sheet.grid.node_at(5, column);
    sheet.grid.nodes[node].broken[kRight] = sheet.grid.nodes[node].broken[kLeft] = true;
    if (column != 4) sheet.claims[node].status = RegionStatus::kClassDisagrees;
  }
  sheet.refuse_lone();
  EXPECT_EQ(sheet.at(5, 4).status, RegionStatus::kNeighboursDisagree);
  for (const int column : {1, 2}) sheet.at(5, column).status = kDecoded;
  sheet.at(5, 5).status = sheet.at(5, 6).status = sheet.at(5, 4).status = kDecoded;
  sheet.refuse_lone();
  EXPECT_EQ(sheet.at(5, 4).status, kDecoded);
}

TEST(RefuseLone, CountsHalfWhatIsDamagedBesideWhatIsOffTheGrid) {
  EXPECT_EQ(left_of("ddwwd", GridFit::kNone), ".....");
  EXPECT_EQ(left_of("dwwd", GridFit::kNone), ".ww.");
  EXPECT_EQ(left_of("ddwwd"), "..ww.") << "beside what fits the grid it says nothing";
  EXPECT_EQ(left_of("ttwwt"), ".....") << "but where it is torn";
}

TEST(RefuseLone, KeepsWhatIsWholeAtARimAndInside) {
  RimSheet sheet;
  for (const int column : {2, 6}) sheet.at(5, column).status = RegionStatus::kDamagedShape;
  for (const int column : {0, 1, 2, 3, 5, 6}) sheet.at(2, column).status = RegionStatus::kDamagedShape;
  const std::vector<CellClaim> before = sheet.claims;
  sheet.refuse_lone();
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(sheet.claims[i].status, before[i].status) << i;
}

}  // namespace
}  // namespace slsd
