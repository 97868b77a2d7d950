// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/light_periods.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <rapidcheck.h>

namespace slsd {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Optional;

constexpr LightPeriods kDlp{.refresh_hz = 60.0, .power_line_hz = 0.0};
constexpr LightPeriods kDlpAnd50Hz{.refresh_hz = 60.0, .power_line_hz = 50.0};
constexpr LightPeriods kDlpAnd60Hz{.refresh_hz = 60.0, .power_line_hz = 60.0};
constexpr LightPeriods kSteady{.refresh_hz = 0.0, .power_line_hz = 0.0};

TEST(FitExposure, TakesWholeFramesOfTheProjectorAsCamerasRoundThem) {
  for (const double exposure_us : {16667.0, 16700.0, 16600.0, 33333.0, 50000.0}) {
    EXPECT_TRUE(fit_exposure(exposure_us, kDlp).fits()) << exposure_us;
  }
}

TEST(FitExposure, NamesTheNearestWholeFrames) {
  const ExposureFit fit = fit_exposure(20000, kDlp);
  EXPECT_FALSE(fit.projector);
  EXPECT_TRUE(fit.lamps);
  EXPECT_THAT(fit.shorter_us, Optional(DoubleNear(16667, 1)));
  EXPECT_THAT(fit.longer_us, Optional(DoubleNear(33333, 1)));
}

TEST(FitExposure, HasNothingShorterThanOneFrame) {
  const ExposureFit fit = fit_exposure(5000, kDlp);
  EXPECT_FALSE(fit.fits());
  EXPECT_EQ(fit.shorter_us, std::nullopt);
  EXPECT_THAT(fit.longer_us, Optional(DoubleNear(16667, 1)));
}

TEST(FitExposure, LooksForWhatSuitsProjectorAndLamps) {
  const ExposureFit fit = fit_exposure(33333, kDlpAnd50Hz);
  EXPECT_TRUE(fit.projector);
  EXPECT_FALSE(fit.lamps);
  EXPECT_EQ(fit.shorter_us, std::nullopt);
  EXPECT_THAT(fit.longer_us, Optional(DoubleNear(50000, 1)));
  EXPECT_TRUE(fit_exposure(50000, kDlpAnd50Hz).fits());
  EXPECT_TRUE(fit_exposure(16667, kDlpAnd60Hz).fits());
}

TEST(FitExposure, SteadyLightSuitsEveryExposure) {
  EXPECT_TRUE(fit_exposure(1234, kSteady).fits());
  EXPECT_THAT(fitting_exposures(kSteady, 1e6), IsEmpty());
}

TEST(FittingExposures, AreWholePeriodsOfBoth) {
  EXPECT_THAT(fitting_exposures(kDlp, 50000),
              ElementsAre(DoubleNear(16667, 1), DoubleNear(33333, 1), DoubleNear(50000, 1)));
  EXPECT_THAT(fitting_exposures(kDlpAnd50Hz, 100000), ElementsAre(DoubleNear(50000, 1), DoubleNear(100000, 1)));
  EXPECT_THAT(fitting_exposures({.refresh_hz = 0.0, .power_line_hz = 60.0}, 20000),
              ElementsAre(DoubleNear(8333, 1), DoubleNear(16667, 1)));
}

// The brightest that a part of a period can add, over all that the whole periods catch.
TEST(FitExposure, WhatFitsVariesByOnePercentAtMost) {
  EXPECT_TRUE(rc::check([] {
    const LightPeriods periods{.refresh_hz = *rc::gen::inRange(24, 240) * 1.0, .power_line_hz = 0.0};
    const double exposure_us = *rc::gen::inRange(100, 500'000);
    const double part_us = std::remainder(exposure_us, periods.projector_us());
    const bool steady = exposure_us > 0.5 * periods.projector_us() && std::abs(part_us) <= 0.01 * exposure_us;
    RC_ASSERT(fit_exposure(exposure_us, periods).fits() == steady);
  }));
}

TEST(FitExposure, WhatItNamesFits) {
  EXPECT_TRUE(rc::check([] {
    const LightPeriods periods{.refresh_hz = *rc::gen::element(50.0, 59.94, 60.0, 85.0, 120.0),
                               .power_line_hz = *rc::gen::element(0.0, 50.0, 60.0)};
    const double exposure_us = *rc::gen::inRange(100, 900'000);
    const ExposureFit fit = fit_exposure(exposure_us, periods);
    for (const auto& named_us : {fit.shorter_us, fit.longer_us}) {
      if (named_us) RC_ASSERT(fit_exposure(*named_us, periods).fits());
    }
  }));
}

TEST(ExposureMisfit, NamesThePeriodAndTheNearestExposures) {
  EXPECT_EQ(exposure_misfit(20000, kDlp),
            "is not a whole multiple of a projector frame (16667 us at 60 Hz), so frames differ in brightness: set "
            "16667 or 33333");
  EXPECT_EQ(exposure_misfit(16667, kDlpAnd50Hz),
            "is not a whole multiple of half a lamp period (10000 us at 50 Hz), so frames differ in brightness: set "
            "50000");
  EXPECT_EQ(exposure_misfit(12000, kDlpAnd50Hz),
            "is not a whole multiple of a projector frame (16667 us at 60 Hz), nor of half a lamp period (10000 us at "
            "50 Hz), so frames differ in brightness: set 50000");
}

TEST(ExposureMisfit, NamesTheOnlyExposureThatIsNear) {
  EXPECT_THAT(exposure_misfit(20'000, {.refresh_hz = 24.0}), ::testing::EndsWith(": set 41667"));
  EXPECT_THAT(exposure_misfit(1'020'000, {.refresh_hz = 24.0}), ::testing::EndsWith(": set 1000000"));
}

TEST(ExposureMisfit, IsEmptyIfTheExposureSuits) {
  EXPECT_EQ(exposure_misfit(16700, kDlp), "");
  EXPECT_EQ(exposure_misfit(1234, kSteady), "");
}

}  // namespace
}  // namespace slsd
