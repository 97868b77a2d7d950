// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/inference/letter_evidence.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "tests/core/decode/grid/simulated_grid.hpp"

namespace slsd {
namespace {

constexpr int kLetters = 5;

/// Rows of five cells, each of the letter of its column.
CodeArray columns_of_letters(int rows) {
  CodeArray array{rows, kLetters, kLetters, {}, 0};
  for (int i = 0; i < rows * kLetters; ++i) array.cells.push_back(static_cast<std::uint8_t>(i % kLetters));
  return array;
}

Classification shape_of(int letter, float distance) {
  Classification shape = read_as(letter, kLetters, 0.98);
  shape.distance = distance;
  return shape;
}

TEST(LetterEvidence, IsAtMostTheLogarithmOfTheLetters) {
  const CodeArray array = columns_of_letters(1);
  LetterEvidence evidence(array, {1, kLetters});
  const std::vector<Classification> shapes{shape_of(2, 1)};
  const std::vector<Aligned> aligned(1);
  evidence.look_at(shapes, aligned);
  EXPECT_LE(evidence.of(0, 2), std::log(5.F));
  EXPECT_GT(evidence.of(0, 2), std::log(5.F) - 0.05F);
  EXPECT_LT(evidence.of(0, 3), -2);
}

TEST(LetterEvidence, IsLessTheFartherAShapeIsFromItsLetter) {
  const CodeArray array = columns_of_letters(1);
  LetterEvidence evidence(array, {1, kLetters});
  std::vector<Classification> shapes;
  for (const float distance : {2.5F, 3.5F, 5.F, 7.F, 10.F, 30.F}) shapes.push_back(shape_of(2, distance));
  const std::vector<Aligned> aligned(shapes.size());
  evidence.look_at(shapes, aligned);
  for (std::int32_t i = 0; i + 1 < static_cast<std::int32_t>(shapes.size()); ++i) {
    EXPECT_GT(evidence.of(i, 2), evidence.of(i + 1, 2)) << i;
    EXPECT_LT(evidence.of(i, 1), evidence.of(i + 1, 1)) << i;
  }
}

TEST(LetterEvidence, SaysNothingOfAShapeThatIsNoLetter) {
  const CodeArray array = columns_of_letters(1);
  LetterEvidence evidence(array, {1, kLetters});
  std::vector<Classification> shapes{shape_of(2, 1)};
  const std::vector<Aligned> aligned(1);
  shapes[0].letter = -1;
  evidence.look_at(shapes, aligned);
  EXPECT_EQ(evidence.of(0, 2), 0);
}

// Amid whole surfaces a split shape is rare, so it speaks for an edge; print that split it does not.
TEST(LetterEvidence, OfATornShapeSpeaksForAnEdgeUnlessItWasPrintedOn) {
  constexpr int kHigh = 9;
  const CodeArray array = columns_of_letters(kHigh);
  LetterEvidence evidence(array, {kHigh, kLetters});
  std::vector<Classification> shapes;
  std::vector<Beside> beside;
  std::vector<std::int32_t> labels;
  for (int i = 0; i < kHigh * kLetters; ++i) {
    const int row = i / kLetters, column = i % kLetters;
    const auto at = [&](int r, int c) { return r < 0 || c < 0 || r >= kHigh || c >= kLetters ? -1 : r * kLetters + c; };
    beside.push_back({at(row, column + 1), at(row + 1, column), at(row, column - 1), at(row - 1, column)});
    shapes.push_back(shape_of(column, 1));
    labels.push_back(i);
  }
  shapes.back().distance = 20;
  std::vector<Aligned> aligned(shapes.size());
  evidence.look_at(shapes, aligned);
  const std::int32_t split = kHigh * kLetters - 1;
  const float before = evidence.of(split, split);
  evidence.measure_split(beside, labels);
  EXPECT_LT(evidence.of(split, split), before - 1);
  aligned.back() = Aligned::kWhole;
  EXPECT_EQ(evidence.of(split, split), before);
  aligned.back() = Aligned::kPrinted;
  EXPECT_EQ(evidence.of(split, split), 0) << "what cannot be aligned may be another symbol";
  aligned.back() = Aligned::kAtEdge;
  EXPECT_LT(evidence.of(split, split), before - 1) << "though its letter could be aligned";
}

}  // namespace
}  // namespace slsd
