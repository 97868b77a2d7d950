// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/exposure_advice.hpp"

#include <cmath>

#include <gmock/gmock.h>

#include "tests/core/exposure/seen_by_camera.hpp"

namespace slsd {
namespace {

using ::testing::Contains;
using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr double kFrameUs = 1e6 / 60;

/// A camera before a scene: brighter in proportion to exposure and gain, clipped at full.
class CameraOf {
 public:
  /// @param brighter  than the corpus' frame, at one frame of the projector and no gain
  CameraOf(const std::string& scene, double brighter) : frame_(corpus_frame(scene)), brighter_(brighter) {}

  [[nodiscard]] LightLevels look(const ExposureSetting& setting) const {
    const double light = setting.exposure_us / kFrameUs * std::pow(10.0, setting.gain_db / 20.0);
    return measure_light(exposed(frame_, brighter_ * light).view(), 255);
  }

  /// Sets what is advised and looks again, until nothing changes.
  [[nodiscard]] std::pair<ExposureSetting, ExposureAdvice> settle(ExposureSetting setting,
                                                                  const ExposureLimits& limits) const {
    ExposureAdvice advice;
    for (int looks = 0; looks < 6; ++looks) {
      advice = advise_exposure({.levels = look(setting)}, setting, limits);
      if (!advice.setting) break;
      setting = *advice.setting;
    }
    return {setting, advice};
  }

 private:
  Grey8 frame_;
  double brighter_;
};

class Scenes : public ::testing::TestWithParam<std::tuple<const char*, double>> {};

TEST_P(Scenes, BringsTheSymbolsToThreeQuartersWhateverTheBeginning) {
  const auto [scene, brighter] = GetParam();
  const CameraOf camera(scene, brighter);
  for (const ExposureSetting& begin : {ExposureSetting{kFrameUs, 0}, ExposureSetting{6 * kFrameUs, 12}}) {
    const auto [setting, advice] = camera.settle(begin, {});
    const LightLevels levels = camera.look(setting);
    EXPECT_THAT(levels.lit_brightest / levels.full, DoubleNear(0.75, 0.12));
    EXPECT_FALSE(advice.look_again);
    EXPECT_THAT(advice.troubles, IsEmpty());
    EXPECT_TRUE(fit_exposure(setting.exposure_us, {}).fits()) << setting.exposure_us;
  }
}

INSTANTIATE_TEST_SUITE_P(AdviseExposure, Scenes,
                         ::testing::Combine(::testing::Values("16px-5-plane_30", "16px-5-step", "8px-6-plane_0"),
                                            ::testing::Values(0.05, 0.2, 0.7)));

TEST(AdviseExposure, LeavesAGoodFrameAlone) {
  const LightLevels levels = measure_light(corpus_frame("16px-5-plane_30").view(), 255);
  const ExposureAdvice advice = advise_exposure({.levels = levels}, ExposureSetting{kFrameUs, 0}, {});
  EXPECT_EQ(advice.brighter, 1);
  EXPECT_THAT(advice.troubles, IsEmpty());
  ASSERT_TRUE(advice.setting);
  EXPECT_THAT(advice.setting->exposure_us, DoubleNear(kFrameUs, 1));
  EXPECT_EQ(advice.setting->gain_db, 0);
}

TEST(AdviseExposure, SaysWhenLightIsTooMuchOrTooLittleForAnySetting) {
  const auto troubles_at = [](double brighter) {
    return CameraOf("16px-5-plane_30", brighter).settle({kFrameUs, 0}, {}).second.troubles;
  };
  EXPECT_THAT(troubles_at(6), Contains(Trouble::kTooMuchLight));
  EXPECT_THAT(troubles_at(0.05), Not(Contains(Trouble::kTooLittleLight)));
  const CameraOf dark("16px-5-plane_30", 0.1);
  ExposureLimits strict;
  strict.exposure_max_us = 17'000;
  strict.gain_max_db = 6;
  EXPECT_THAT(dark.settle({kFrameUs, 0}, strict).second.troubles, ElementsAre(Trouble::kTooLittleLight));
}

TEST(AdviseExposure, TakesAnyExposureOfASteadyProjector) {
  ExposureLimits steady;
  steady.periods.refresh_hz = 0;
  const auto [setting, advice] = CameraOf("16px-5-plane_30", 6).settle({kFrameUs, 0}, steady);
  EXPECT_LT(setting.exposure_us, kFrameUs / 4);
  EXPECT_EQ(setting.gain_db, 0);
  EXPECT_THAT(advice.troubles, IsEmpty());
}

TEST(AdviseExposure, ThinksOfTheLamps) {
  ExposureLimits lamps;
  lamps.periods.power_line_hz = 50;
  const auto [setting, advice] = CameraOf("16px-5-plane_30", 0.2).settle({kFrameUs, 0}, lamps);
  EXPECT_TRUE(fit_exposure(setting.exposure_us, lamps.periods).fits()) << setting.exposure_us;
}

TEST(AdviseExposure, KeepsTheExposureShortWhereThingsMove) {
  const LightLevels levels = CameraOf("16px-5-plane_30", 0.2).look({kFrameUs, 0});
  const FrameChange moving{.noise = 1, .moved_share = 0.3, .brighter = 1};
  const ExposureAdvice advice = advise_exposure({.levels = levels, .change = moving}, ExposureSetting{kFrameUs, 0}, {});
  EXPECT_THAT(advice.troubles, ElementsAre(Trouble::kMoves));
  EXPECT_THAT(advice.setting->exposure_us, DoubleNear(kFrameUs, 1));
  EXPECT_THAT(advice.setting->gain_db, DoubleNear(13.3, 1.5));
}

TEST(AdviseExposure, NamesWhatItCannotCorrect) {
  const Grey8 frame = corpus_frame("16px-5-plane_30");
  const auto troubles = [](const Grey8& image, const std::optional<FrameChange>& change = {}) {
    return advise_exposure({.levels = measure_light(image.view(), 255), .change = change}, {}, {}).troubles;
  };
  EXPECT_THAT(troubles(exposed(frame, 0.5, 250)), ElementsAre(Trouble::kAmbient));
  EXPECT_THAT(troubles(blurred(frame, 1)), IsEmpty());
  EXPECT_THAT(troubles(blurred(frame, 3)), ElementsAre(Trouble::kBlurred));
  EXPECT_THAT(troubles(Grey8(640, 480, 4)), ElementsAre(Trouble::kNoPattern));
  EXPECT_THAT(troubles(frame, FrameChange{.noise = 40, .moved_share = 0, .brighter = 1}), ElementsAre(Trouble::kNoisy));
  EXPECT_THAT(troubles(frame, FrameChange{.noise = 1, .moved_share = 0, .brighter = 0.9}),
              ElementsAre(Trouble::kFlickers));
  EXPECT_THAT(troubles(frame), IsEmpty());
}

TEST(AdviseExposure, NamesTheCamerasOwnTroubles) {
  const Grey8 scene = corpus_frame("16px-5-plane_30");
  const auto light_of = [&](const SimulatedCamera& camera, double brighter = 1) {
    const Grey8 first = seen_by(camera, scene, 1);
    return measure_frame_light(first.view(), exposed(seen_by(camera, scene, 2), brighter).view(), 255);
  };
  const auto troubles = [](const FrameLight& light) { return advise_exposure(light, {}, {}).troubles; };
  EXPECT_THAT(troubles(light_of({})), IsEmpty());
  EXPECT_THAT(troubles(light_of({.grain = 1})), ElementsAre(Trouble::kGrain));
  EXPECT_THAT(troubles(light_of({.gamma = 0.65})), ElementsAre(Trouble::kGamma));
  EXPECT_THAT(troubles(light_of({.gamma = 0.65, .grain = 1})), ElementsAre(Trouble::kGrain, Trouble::kGamma));
  FrameLight darker = light_of({}, 0.8);
  EXPECT_THAT(troubles(darker), ElementsAre(Trouble::kFlickers));
  darker.exposure_is_configured = false;
  EXPECT_THAT(troubles(darker), ElementsAre(Trouble::kAutomaticExposure));
}

TEST(AdviseExposure, NamesClippedSymbolsBandsAndUnevenPitch) {
  const Grey8 frame = corpus_frame("16px-5-plane_30");
  const auto clipped = advise_exposure({.levels = measure_light(exposed(frame, 4).view(), 255)}, {}, {});
  EXPECT_THAT(clipped.troubles, ElementsAre(Trouble::kClipped));
  EXPECT_TRUE(clipped.look_again);
  FrameLight bands{.levels = measure_light(frame.view(), 255), .change = FrameChange{.bands = 0.05}};
  EXPECT_THAT(advise_exposure(bands, {}, {}).troubles, ElementsAre(Trouble::kFlickers));
  FrameLight scaled{.levels = measure_light(frame.view(), 255), .pitch = PatternPitch{12, 0.1}};
  EXPECT_THAT(advise_exposure(scaled, {}, {}).troubles, ElementsAre(Trouble::kUnevenPitch));
  bands.between.neighbours = 0.5;  // of the lamps
  EXPECT_THAT(advise_exposure(bands, {}, {}).troubles, ElementsAre(Trouble::kFlickers));
}

TEST(AdviseExposure, NamesEveryTrouble) {
  for (int i = 0; i < kTroubleCount; ++i) {
    EXPECT_FALSE(to_string(static_cast<Trouble>(i)).empty());
    EXPECT_FALSE(remedy(static_cast<Trouble>(i)).empty());
  }
}

}  // namespace
}  // namespace slsd
