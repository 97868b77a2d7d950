// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbols/symbol_warnings.hpp"

#include <gmock/gmock.h>

#include "core/decode/symbols/separability.hpp"
#include "tests/core/geometry/paper_rig.hpp"

namespace slsd {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(PatternScale, IsOfTheCameraThatSeesThePatternSmallest) {
  Calibration rig = paper_rig();
  const double alone = pattern_scale(rig, {});
  rig.cameras.push_back(rig.cameras.front());
  rig.cameras.back().lens.fx /= 2, rig.cameras.back().lens.fy /= 2;
  EXPECT_NEAR(pattern_scale(rig, {}), alone / 2, 0.02 * alone);
}

TEST(PatternScale, IsOfThePapersRigWithoutACalibration) {
  EXPECT_EQ(pattern_scale(std::nullopt, {}), LookOptions{}.camera_px_per_projector_px);
}

TEST(SymbolWarnings, AreNoneForTheDefaultPattern) {
  EXPECT_THAT(symbol_warnings(make_pattern({})->options, 1.4), IsEmpty());
}

TEST(SymbolWarnings, NameSymbolsThatTheCameraSeesTooSmall) {
  PatternOptions small;
  small.symbol_size_px = 8;
  small.spacing_px = 1;
  EXPECT_THAT(symbol_warnings(make_pattern(small)->options, 0.5), Contains(HasSubstr("at 8 px")));
}

TEST(SymbolWarnings, SayWhyTheyCannotTell) {
  PatternOptions one;
  one.symbols = {7};
  EXPECT_THAT(symbol_warnings(one, 1.4), Contains(HasSubstr("at least two symbols")));
}

}  // namespace
}  // namespace slsd
