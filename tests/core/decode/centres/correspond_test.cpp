// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/correspond.hpp"

#include <vector>

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
  void add(int lit_row, int lit_column, int row, int column, double depth_mm = 2000) {
    const Surface wall = plane({0, 0, depth_mm}, {0, 0, 1});
    const auto seen = camera_from_projector(cells_.pixel(lit_row, lit_column), rig_, wall);
    ASSERT_TRUE(seen);
    segments_.push_back(gate_.prepare(rig_.cameras[0].lens.undistort(*seen)));
    claims_.push_back({static_cast<std::int16_t>(row), static_cast<std::int16_t>(column), 20, kDecoded});
  }

  std::vector<RegionStatus> statuses() {
    Correspondence().correspond(cells_, segments_, 1.5, alone, claims_);
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
  add(20, 30, 20, 30, 1400);
  add(10, 40, 10, 40, 2600);
  add(30, 35, 30, 35, 1600);
  EXPECT_THAT(statuses(),
              testing::ElementsAre(RegionStatus::kOutOfDepthRange, RegionStatus::kOutOfDepthRange, kDecoded));
}

TEST_F(Correspond, GivesACellToNoneOfSeveralClaims) {
  add(20, 30, 20, 30);
  add(20, 30, 20, 30);
  add(10, 10, 10, 10);
  add(20, 30, 20, 30);
  EXPECT_THAT(statuses(), testing::ElementsAre(kDuplicate, kDuplicate, kDecoded, kDuplicate));
}

TEST_F(Correspond, WeighsNoClaimThatTheLineRejected) {
  add(20, 30, 20, 30);
  add(22, 30, 20, 30);
  EXPECT_THAT(statuses(), testing::ElementsAre(kDecoded, RegionStatus::kOffEpipolarLine));
}

TEST_F(Correspond, LeavesEarlierReasonsAlone) {
  add(20, 30, 20, 30);
  claims_[0].status = RegionStatus::kClassDisagrees;
  EXPECT_THAT(statuses(), testing::ElementsAre(RegionStatus::kClassDisagrees));
}

}  // namespace
}  // namespace slsd
