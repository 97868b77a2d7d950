// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/torn_lines.hpp"

#include <algorithm>
#include <cmath>

#include "tests/core/decode/centres/mended_plane.hpp"

namespace slsd {
namespace {

/// A plane that stands; what an edge runs through is worn along its middle row, or column.
class OnTornLine : public test::MendedPlane {
 protected:
  static constexpr int kMiddle = kSide / 2;
  OnTornLine() { seen_.claims[kWorn].status = RegionStatus::kDecoded; }

  /// Damages a symbol: level(grey value) is what is seen of the half of its cell that lies beyond the edge.
  template <class Level>
  void damage(int row, int column, bool along_row, const Level& level) {
    const int node = row * kSide + column;
    seen_.claims[node].status = RegionStatus::kDamagedShape;
    seen_.shapes[node].distance = 6.1F;
    const Eigen::Vector2f centre = true_centre(row, column);
    const int u = static_cast<int>(std::lround(centre.x())), v = static_cast<int>(std::lround(centre.y()));
    for (int beyond = 1; beyond <= 9; ++beyond) {
      for (int along = -9; along <= 9; ++along) {
        std::uint8_t& pixel = along_row ? frame_.at(u + along, v + beyond) : frame_.at(u + beyond, v + along);
        pixel = level(pixel);
      }
    }
  }
  static std::uint8_t other_letter(std::uint8_t level) { return level > 90 ? 12 : 170; }
  static std::uint8_t print(std::uint8_t level) { return static_cast<std::uint8_t>(level / 3); }

  void tear(std::initializer_list<int> columns) {
    for (const int column : columns) damage(kMiddle, column, true, other_letter);
  }
  void refuse() {
    look([&](const LetterScene& scene) { TornLines(pattern_, letters_).refuse(scene); });
  }
  /// Of the middle row: w stands, and r has been refused; a dot is damaged.
  [[nodiscard]] std::string row() const {
    std::string text;
    for (int column = 0; column < kSide; ++column) {
      const RegionStatus status = seen_.claims[kMiddle * kSide + column].status;
      text += status == RegionStatus::kDecoded ? 'w' : status == RegionStatus::kNeighboursDisagree ? 'r' : '.';
    }
    return text;
  }
  [[nodiscard]] std::ptrdiff_t refused() const {
    return std::ranges::count(seen_.claims, RegionStatus::kNeighboursDisagree, &CellClaim::status);
  }
};

TEST_F(OnTornLine, IsRefusedWhereAsManyShowOtherLightAsStand) {
  tear({0, 4});
  seen_.claims[kMiddle * kSide + 3].status = RegionStatus::kDamagedShape;
  refuse();
  EXPECT_EQ(row(), ".rr..");
  EXPECT_EQ(refused(), 2) << "none beside the row";
}

TEST_F(OnTornLine, StaysWhereMoreStand) {
  tear({0, 4});
  refuse();
  EXPECT_EQ(row(), ".www.");
  EXPECT_EQ(refused(), 0);
}

TEST_F(OnTornLine, IsRefusedAlongAColumn) {
  for (const int other : {0, 1, 3, 4}) damage(other, kMiddle, false, other_letter);
  refuse();
  EXPECT_EQ(row(), "wwrww");
  EXPECT_EQ(refused(), 1);
}

// Ink takes light, and gives none.
TEST_F(OnTornLine, StaysBesidePrint) {
  for (const int column : {0, 1, 3, 4}) damage(kMiddle, column, true, print);
  refuse();
  EXPECT_EQ(row(), "..w..");
}

// A twentieth of a cell may be anything.
TEST_F(OnTornLine, StaysBesideAFewLitPixels) {
  for (const int column : {0, 1, 3, 4}) damage(kMiddle, column, true, [](std::uint8_t level) { return level; });
  for (const int column : {0, 1, 3, 4}) {
    const Eigen::Vector2f centre = true_centre(kMiddle, column);
    frame_.at(static_cast<int>(centre.x()) + 8, static_cast<int>(centre.y()) + 8) = 170;
  }
  refuse();
  EXPECT_EQ(row(), "..w..");
}

TEST_F(OnTornLine, LooksAtWhatIsTornOrMisread) {
  tear({0, 1, 3, 4});
  const Sightings torn = seen_;
  for (const int column : {0, 1, 3, 4}) seen_.shapes[kMiddle * kSide + column].distance = 5.9F;
  refuse();
  EXPECT_EQ(row(), "..w..") << "hardly damaged";
  for (const int column : {0, 1, 3, 4}) seen_.claims[kMiddle * kSide + column].status = RegionStatus::kClassDisagrees;
  refuse();
  EXPECT_EQ(row(), "..r..") << "misread";
  seen_ = torn;
  for (const int column : {0, 1, 3, 4}) seen_.claims[kMiddle * kSide + column].row = kRow;
  refuse();
  EXPECT_EQ(row(), "..w..") << "of another row";
}

// Of a torn one that was mended half may be of its letter. Without those that it refuses it is outvoted itself.
TEST_F(OnTornLine, IsRefusedWithWhatWasMendedOnIt) {
  tear({0, 1, 4});
  seen_.claims[kMiddle * kSide + 1].status = RegionStatus::kDecoded;
  refuse();
  EXPECT_EQ(row(), ".rrr.");
}

TEST_F(OnTornLine, StaysWithWhatWasMendedBeneathPrint) {
  tear({0, 4});
  damage(kMiddle, 1, true, print);
  seen_.claims[kMiddle * kSide + 1].status = RegionStatus::kDecoded;
  refuse();
  EXPECT_EQ(row(), ".www.");
}

TEST_F(OnTornLine, TakesWithItWhatItLeavesAlone) {
  const int below = (kMiddle + 1) * kSide + 2;
  for (int column = 0; column < kSide; ++column) {
    seen_.claims[kMiddle * kSide + column].status = RegionStatus::kDamagedShape;
    seen_.claims[(kMiddle + 1) * kSide + column].status = RegionStatus::kDamagedShape;
    seen_.claims[(kMiddle + 2) * kSide + column].status = RegionStatus::kDamagedShape;
  }
  tear({0, 4});
  seen_.claims[kWorn].status = seen_.claims[below].status = RegionStatus::kDecoded;
  const Sightings all = seen_;
  refuse();
  EXPECT_EQ(row(), "..r..");
  EXPECT_EQ(seen_.claims[below].status, RegionStatus::kNeighboursDisagree);
  seen_ = all;
  seen_.claims[below + 1].status = RegionStatus::kDecoded;
  refuse();
  EXPECT_EQ(row(), "..r..");
  EXPECT_EQ(seen_.claims[below].status, RegionStatus::kDecoded) << "another stands beside it";
}

// Whatever its light: print makes no letters.
TEST_F(OnTornLine, IsRefusedBesideOtherLettersThatAreWellSeen) {
  for (const int column : {0, 1, 3, 4}) {
    const int node = kMiddle * kSide + column;
    seen_.claims[node].status = RegionStatus::kClassDisagrees;
    seen_.shapes[node].letter = 0, seen_.shapes[node].distance = 3.1F;
  }
  refuse();
  EXPECT_EQ(row(), "..w..");
  for (const int column : {0, 1, 3, 4}) seen_.shapes[kMiddle * kSide + column].distance = 2.9F;
  refuse();
  EXPECT_EQ(row(), "..r..");
}

// An edge breaks the links of what it tears, and some of them lead past one that is not seen at all.
TEST_F(OnTornLine, IsFollowedOverBrokenLinksAndGaps) {
  tear({0, 1, 4});
  for (int column = 0; column < kSide; ++column)
    seen_.nodes[kMiddle * kSide + column].broken = {true, true, true, true};
  const int from = kMiddle * kSide;
  seen_.nodes[from].links[kRight] = from + 2, seen_.nodes[from + 2].links[kLeft] = from;
  seen_.claims[from + 3].status = RegionStatus::kDamagedShape;
  refuse();
  EXPECT_EQ(row(), "..r..");
}

// What no link leads back from cannot be looked for, and says nothing.
TEST_F(OnTornLine, StaysWhereNoLinkLeadsBack) {
  tear({0, 1, 3, 4});
  for (const int column : {0, 1, 4}) seen_.nodes[kMiddle * kSide + column].links = {-1, -1, -1, -1};
  refuse();
  EXPECT_EQ(row(), "..w..");
}

}  // namespace
}  // namespace slsd
