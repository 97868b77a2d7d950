// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/inference/infer_cells.hpp"

#include <algorithm>
#include <memory>
#include <random>
#include <span>
#include <vector>

#include <gmock/gmock.h>

#include "tests/core/decode/alone.hpp"
#include "tests/core/decode/grid/simulated_grid.hpp"
#include "tests/core/decode/shipped_pattern.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

/// Nodes of a grid, linked wherever two are side by side, that show the letters they are given.
class InferCells : public testing::Test {
 protected:
  InferCells()
      : pattern_(shipped_pattern("16px-5.toml")),
        cells_(pattern_, flat_prototypes(), paper_rig().projector),
        codebook_(std::make_shared<const Codebook>(pattern_.array, kWholeRows, kWholeColumns)) {}

  void show(int row, int column, int letter, float distance = 1) {
    grid_.add(row, column, {18.F * static_cast<float>(column), 18.F * static_cast<float>(row)},
              LatticeFrame::Identity());
    Classification shape = read_as(letter, 5, 0.99);
    shape.distance = distance;
    seen_.shapes.push_back(shape);
  }
  /// @param shifted  columns by which the letters are those of other cells
  void show_pattern(int top, int left, int bottom, int right, int shifted = 0) {
    for (int row = top; row < bottom; ++row)
      for (int column = left; column < right; ++column) show(row, column, pattern_.array.at(row, column + shifted));
  }
  void infer() {
    grid_.link_truly();
    seen_.nodes = grid_.nodes;
    seen_.region.resize(seen_.nodes.size());
    seen_.moments.assign(seen_.nodes.size(), {});
    for (GreyMoments& moments : seen_.moments) moments.background = 20, moments.peak = 180;
    if (!seen_.moments.empty()) seen_.moments.back().peak = peak_of_last_;
    // Each cell where it is at one depth; those of shifted letters lie on the same lines.
    const Calibration rig = paper_rig();
    const RigidTransform& to_projector = rig.cameras[0].projector_from_camera;
    const EpipolarGate lines(rig.cameras[0], rig.projector, 350, 3200);
    segments_.clear();
    for (const auto& [row, column] : grid_.cells) {
      const int line_of = row < first_row_off_line_ ? row : row + 1;
      const Eigen::Vector3d point = 1000 * cells_.ray(line_of, column).direction.homogeneous();
      segments_.push_back(
          lines.prepare((to_projector.rotation.transpose() * (point - to_projector.translation)).hnormalized()));
    }
    CellInference inference(pattern_, codebook_, wrong_cells_max_);
    const CellGate gate(cells_, segments_, 1.5);
    inference.propose(gate, alone, seen_);
    inference.decide(gate, alone, seen_);
  }
  [[nodiscard]] const CellClaim& claim_at(int row, int column) const {
    return seen_.claims[static_cast<std::size_t>(grid_.node_at(row, column))];
  }
  struct Score {
    int decoded = 0, wrong = 0;
  };
  /// Those that show the letters of their own cells are right there.
  [[nodiscard]] Score score() const {
    Score score;
    for (std::size_t i = 0; i < seen_.claims.size(); ++i) {
      if (seen_.claims[i].status != RegionStatus::kDecoded) continue;
      ++score.decoded;
      score.wrong += !seen_.claims[i].same_cell(grid_.cells[i].first, grid_.cells[i].second);
    }
    return score;
  }

  Pattern pattern_;
  CellRays cells_;
  std::shared_ptr<const Codebook> codebook_;
  SimulatedGrid grid_;
  Sightings seen_;
  float peak_of_last_ = 180;
  int first_row_off_line_ = 1000;  // from which on the epipolar lines are those of the next row
  double wrong_cells_max_ = 0.005;
  std::vector<EpipolarSegment> segments_;
};

TEST_F(InferCells, AcceptsAWholeSurface) {
  show_pattern(2, 3, 30, 40);
  infer();
  EXPECT_EQ(score().decoded, 28 * 37);
  EXPECT_EQ(score().wrong, 0);
}

TEST_F(InferCells, AcceptsNothingOfRandomLetters) {
  std::mt19937 random(4);
  for (int row = 0; row < 40; ++row)
    for (int column = 0; column < 60; ++column) show(row, column, static_cast<int>(random() % 5));
  infer();
  EXPECT_EQ(score().decoded, 0);
}

TEST_F(InferCells, AcceptsNoComponentOfThreeSymbols) {
  show_pattern(5, 5, 6, 8);
  infer();
  EXPECT_EQ(score().decoded, 0);
}

// Links across an edge in depth that is not seen as one lead to symbols of other cells.
TEST_F(InferCells, KeepsTwoSurfacesApart) {
  show_pattern(0, 0, 30, 20);
  for (int row = 0; row < 30; ++row)
    for (int column = 20; column < 40; ++column) show(row, column, pattern_.array.at(row, column + 6));
  infer();
  for (std::size_t i = 0; i < seen_.claims.size(); ++i) {
    const auto [row, column] = grid_.cells[i];
    if (seen_.claims[i].status != RegionStatus::kDecoded) continue;
    EXPECT_TRUE(seen_.claims[i].same_cell(row, column < 20 ? column : column + 6)) << row << ", " << column;
  }
  EXPECT_GT(score().decoded, 30 * 40 * 4 / 5);
}

TEST_F(InferCells, SaysOfAMisreadSymbolThatItsLetterIsAnother) {
  show_pattern(0, 0, 20, 20);
  const auto node = static_cast<std::size_t>(grid_.node_at(10, 10));
  seen_.shapes[node] = read_as((pattern_.array.at(10, 10) + 1) % 5, 5, 0.99);
  infer();
  EXPECT_EQ(claim_at(10, 10).rule, DecodeRule::kOtherLetter);
  EXPECT_GE(score().decoded, 20 * 20 - 5);  // those beside it may lie across an edge from it
  EXPECT_EQ(score().wrong, 0);
}

TEST_F(InferCells, SaysOfATornSymbolThatItIsDamaged) {
  show_pattern(0, 0, 20, 20);
  const auto node = static_cast<std::size_t>(grid_.node_at(10, 10));
  seen_.shapes[node].distance = 20;
  infer();
  EXPECT_EQ(claim_at(10, 10).status, RegionStatus::kDamagedShape);
  EXPECT_TRUE(claim_at(10, 10).same_cell(10, 10));
}

// As of a rig that has moved: some rows lie on the lines of their cells by chance.
TEST_F(InferCells, RejectsASurfaceMostOfWhichIsOffItsLines) {
  const auto infer_moved = [&](int rows_on_line) {
    grid_ = {}, seen_ = {};
    show_pattern(2, 2, 22, 30);
    first_row_off_line_ = 2 + rows_on_line;
    infer();
    return score().decoded;
  };
  EXPECT_EQ(infer_moved(8), 0);
  EXPECT_GE(infer_moved(12), 11 * 28);
  EXPECT_GE(std::ranges::count(seen_.claims, RegionStatus::kOffEpipolarLine, &CellClaim::status), 6 * 28);
}

// Geometry does not tell a symbol of the wall behind, seen through a gap, from an honest corner.
TEST_F(InferCells, TrustsASymbolThatIsDarkerThanItsHoldersLess) {
  std::vector<float> margins;
  for (const float peak : {180.F, 90.F}) {
    grid_ = {}, seen_ = {};
    show_pattern(0, 0, 20, 20);
    show(20, 19, pattern_.array.at(20, 19));
    peak_of_last_ = peak;
    wrong_cells_max_ = 1e-9;
    infer();
    margins.push_back(claim_at(20, 19).margin_nats);
  }
  EXPECT_LT(margins[1], margins[0] - 1);
}

TEST_F(InferCells, OfNoNodesIsNothing) {
  infer();
  EXPECT_THAT(seen_.claims, testing::IsEmpty());
}

}  // namespace
}  // namespace slsd
