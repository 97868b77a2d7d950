// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/read_border.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "tests/core/decode/shipped_pattern.hpp"

namespace slsd {
namespace {

constexpr float kScale = 1.5F, kSeen = 0.75F;  // of the symbol

/// One symbol that is decoded, and beside it what the left border of the frame leaves of another.
class SymbolAtTheBorder : public testing::Test {
 protected:
  static constexpr int kRow = 20, kColumn = 30;

  SymbolAtTheBorder()
      : pattern_(shipped_pattern("16px-5.toml")), letters_(std::make_shared<LetterFields>(pattern_.options)) {
    GridNode node;
    node.frame = kScale * LatticeFrame::Identity();
    const float symbol_px = kScale * static_cast<float>(pattern_.options.symbol_size_px);
    beside_px_ = {(kSeen - 0.5F) * symbol_px, 60};
    node.centre_px = beside_px_ + Eigen::Vector2f(kScale * static_cast<float>(pattern_.pitch_px()), 0);
    seen_.region.push_back(0);
    seen_.nodes.push_back(node);
    seen_.claims.push_back({.row = kRow, .column = kColumn, .status = RegionStatus::kDecoded, .island = 0});
  }

  [[nodiscard]] int letter_of_its_cell() const { return pattern_.array.at(kRow, kColumn - 1); }

  /// A frame in which a letter is beside the border, and so many levels of ripple on it.
  [[nodiscard]] Grey8 frame_with(int letter, int ripple = 0) const {
    const PatternField& field = letters_->at(0.7F);
    Grey8 frame(200, 120);
    for (int y = 0; y < frame.height(); ++y) {
      for (int x = 0; x < frame.width(); ++x) {
        const Eigen::Vector2f off = (Eigen::Vector2f(x, y) - beside_px_) / kScale;
        const Eigen::Vector2f at = letters_->middle_px(letter) + off;
        const bool near = off.cwiseAbs().maxCoeff() < static_cast<float>(pattern_.options.symbol_size_px);
        const float light = near ? field.at(at.x(), at.y()).value : 0;
        frame.row(y)[x] =
            static_cast<std::uint8_t>(30 + 150 * light + static_cast<float>((x / 2 * 7 + y / 2 * 13) % 5 * ripple));
      }
    }
    return frame;
  }

  template <class T>
  RegionStatus status_beside(const Image<T>& frame) {
    seen_.claims[0].status = RegionStatus::kDecoded;
    BorderReader(pattern_, letters_).refuse(frame.view(), 0.7F, seen_);
    return seen_.claims[0].status;
  }

  Pattern pattern_;
  std::shared_ptr<const LetterFields> letters_;
  Eigen::Vector2f beside_px_;
  Sightings seen_;
};

// A symbol reaches 12 px to each side; turned by 45 degrees, the square root of two as far.
TEST(IsAtBorder, KeepsThreePixelsFromIt) {
  constexpr float kSymbolPx = 16;
  const Eigen::Vector2f frame_px(200, 120), middle(100, 60);
  LatticeFrame straight = kScale * LatticeFrame::Identity(), turned = straight;
  turned << 1, -1, 1, 1;
  turned *= kScale * std::sqrt(0.5F);
  for (const auto& [frame, reach] : {std::pair(straight, 12.F), {turned, 12 * std::sqrt(2.F)}}) {
    for (const auto& [off_px, at_border] : {std::pair(-0.1F, true), {0.1F, false}}) {
      const float from = reach + 3 + off_px;
      for (const Eigen::Vector2f& centre :
           {Eigen::Vector2f(from, 60), {199 - from, 60}, {100, from}, {100, 119 - from}})
        EXPECT_EQ(is_at_border(centre, frame, kSymbolPx, frame_px), at_border) << centre.transpose();
    }
    EXPECT_FALSE(is_at_border(middle, frame, kSymbolPx, frame_px));
  }
}

TEST_F(SymbolAtTheBorder, StandsBesideItsOwnNeighbour) {
  EXPECT_EQ(status_beside(frame_with(letter_of_its_cell())), RegionStatus::kDecoded);
  EXPECT_EQ(status_beside(frame_with(letter_of_its_cell(), 8)), RegionStatus::kDecoded);
}

TEST_F(SymbolAtTheBorder, IsRefusedBesideAnyOther) {
  const auto letters = static_cast<int>(pattern_.options.symbols.size());
  for (int letter = 0; letter < letters; ++letter) {
    if (letter == letter_of_its_cell()) continue;
    EXPECT_EQ(status_beside(frame_with(letter)), RegionStatus::kNeighboursDisagree) << letter;
  }
}

TEST_F(SymbolAtTheBorder, StandsBesideNothing) {
  for (int level = 0; level <= 255; ++level) {
    Grey8 frame(200, 120);
    for (int y = 0; y < frame.height(); ++y) std::fill_n(frame.row(y), frame.width(), static_cast<std::uint8_t>(level));
    EXPECT_EQ(status_beside(frame), RegionStatus::kDecoded) << level;
  }
}

TEST_F(SymbolAtTheBorder, StandsBesideNothingInADeepFrame) {
  for (int level = 0; level < 65536; level += 257 * 3 + 1) {
    Image<std::uint16_t> frame(200, 120);
    for (int y = 0; y < frame.height(); ++y)
      std::fill_n(frame.row(y), frame.width(), static_cast<std::uint16_t>(level));
    EXPECT_EQ(status_beside(frame), RegionStatus::kDecoded) << level;
  }
}

TEST_F(SymbolAtTheBorder, IsRefusedBesideAnotherInADeepAndBrightFrame) {
  const int other = (letter_of_its_cell() + 1) % static_cast<int>(pattern_.options.symbols.size());
  const Grey8 shallow = frame_with(other);
  Image<std::uint16_t> frame(shallow.width(), shallow.height());
  for (int y = 0; y < frame.height(); ++y)
    for (int x = 0; x < frame.width(); ++x) frame.row(y)[x] = static_cast<std::uint16_t>(60000 + shallow.at(x, y) / 8);
  EXPECT_EQ(status_beside(frame), RegionStatus::kNeighboursDisagree);
}

TEST_F(SymbolAtTheBorder, StandsWhereNoiseIsAllThatIsThere) {
  Grey8 frame(200, 120);
  for (int y = 0; y < frame.height(); ++y)
    for (int x = 0; x < frame.width(); ++x) frame.row(y)[x] = static_cast<std::uint8_t>((x * 7919 + y * 104729) % 61);
  EXPECT_EQ(status_beside(frame), RegionStatus::kDecoded);
}

TEST_F(SymbolAtTheBorder, StandsWhereTooLittleIsSeen) {
  const int other = (letter_of_its_cell() + 1) % static_cast<int>(pattern_.options.symbols.size());
  const float by_px = 0.5F * kScale * static_cast<float>(pattern_.options.symbol_size_px);
  beside_px_.x() -= by_px, seen_.nodes[0].centre_px.x() -= by_px;
  EXPECT_EQ(status_beside(frame_with(other)), RegionStatus::kDecoded);
}

TEST_F(SymbolAtTheBorder, StandsWhereThePatternEnds) {
  seen_.claims[0].column = 0;
  for (int letter = 0; letter < static_cast<int>(pattern_.options.symbols.size()); ++letter)
    EXPECT_EQ(status_beside(frame_with(letter)), RegionStatus::kDecoded) << letter;
}

TEST_F(SymbolAtTheBorder, StandsBesideWhatIsNoLetter) {
  for (const float turn : {0.F, 0.8F, 1.6F, 2.4F}) {
    const Eigen::Vector2f across(std::cos(turn), std::sin(turn));
    for (const float from : {-8.F, -4.F, 0.F}) {
      Grey8 frame(200, 120);
      for (int y = 0; y < frame.height(); ++y) {
        for (int x = 0; x < frame.width(); ++x) {
          const float at = across.dot(Eigen::Vector2f(x, y) - beside_px_) / kScale;
          frame.row(y)[x] = at > from && at < from + 5 ? 180 : 30;
        }
      }
      EXPECT_EQ(status_beside(frame), RegionStatus::kDecoded) << turn << " " << from;
    }
  }
}

TEST_F(SymbolAtTheBorder, IsLeftToOtherRulesWhereItsNeighbourIsRead) {
  const int other = (letter_of_its_cell() + 1) % static_cast<int>(pattern_.options.symbols.size());
  seen_.nodes[0].links[kLeft] = 0;
  EXPECT_EQ(status_beside(frame_with(other)), RegionStatus::kDecoded);
}

}  // namespace
}  // namespace slsd
