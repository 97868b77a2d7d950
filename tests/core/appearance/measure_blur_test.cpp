// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/appearance/measure_blur.hpp"

#include <array>
#include <functional>
#include <random>

#include <gtest/gtest.h>

#include "core/code/pattern.hpp"
#include "tests/core/appearance/plain_light.hpp"
#include "tests/core/geometry/paper_rig.hpp"

namespace slsd {
namespace {

constexpr int kBlurReach = 16;
constexpr double kBlurFull = 65535;
/// Interpolation between a field's samples narrows the pattern, see PatternField. A blur wider by this makes up for it.
constexpr float kOfSampling = 0.135F;  // projector px

const Grey8& shown_pattern() {
  static const Grey8 image = draw_pattern(make_pattern({}).value());
  return image;
}

/// Places of a plane at 2 m that the paper's rig sees under a blurred pattern.
struct Patches {
  Calibration rig = paper_rig();
  Grey16 frame{1600, 1200};
  std::vector<CellTask> tasks;

  /// @param tone_power  the levels are the light to this power
  explicit Patches(double blur_px, double noise = 0, double tone_power = 1) {
    std::mt19937 random(7);
    std::normal_distribution<double> gauss(0, noise);
    const CalibratedCamera& camera = rig.cameras[0];
    for (int i = 0; i < 8; ++i) {
      CellTask& task = tasks.emplace_back();
      task.patch.x = 500 + 61 * i, task.patch.y = 400 + 47 * i;
      const Eigen::Vector2d centre(task.patch.x, task.patch.y);
      task.patch.map =
          make_patch_map(pixel_ray(camera.lens, centre), centre, camera.projector_from_camera, rig.projector, 2000);
      task.patch.noise = static_cast<float>(std::max(64.0, noise));
      task.window_px = 2 * kBlurReach + 1, task.square_half_px = 1e6F;
      for (int y = task.patch.y - kBlurReach; y <= task.patch.y + kBlurReach; ++y) {
        for (int x = task.patch.x - kBlurReach; x <= task.patch.x + kBlurReach; ++x) {
          const Eigen::Vector3d ray = camera.lens.undistort({x, y}).homogeneous();
          const Eigen::Vector2d p = rig.projector.project(camera.projector_from_camera * (2000 * ray));
          const double light = test::plain_light(shown_pattern(), blur_px, p.x(), p.y());
          const double level = 2000 + 40000 * light + gauss(random);
          frame.at(x, y) = static_cast<std::uint16_t>(
              std::lround(kBlurFull * std::pow(std::max(0.0, level) / kBlurFull, tone_power)));
        }
      }
    }
  }

  /// The tone curve's power as the usual way finds it.
  [[nodiscard]] float find_tone() const {
    const PatternFields fields(shown_pattern());
    ToneCurve tone;
    GreyView light = frame.view();
    double full = kBlurFull;
    (void)find_blur_and_tone(
        fields, tone,
        [&] {
          if (!tone.is_straight()) light = tone.light_of(frame.view(), kBlurFull).view(), full = ToneCurve::kFull;
        },
        [&](const PatternField& field) {
          std::vector<CellTask> aligned = tasks;
          align_cells(light, full, field, {}, aligned);
          BlurMeter meter;
          for (const CellTask& task : aligned)
            if (const auto blur = blur_of_patch(light, full, field, {}, task)) meter.add(*blur);
          return BlurSeen{.aligned = 1,
                          .tried = 1,
                          .blur_px = changed_blur_px(field.blur_sigma_px(), meter.change().value_or(0)),
                          .tone_change = meter.tone_change().value_or(0)};
        });
    return tone.power();
  }
  /// The blur after some rounds that start at another.
  [[nodiscard]] float find_from(float blur_px, int rounds) const {
    BlurMeter meter;
    for (int round = 0; round < rounds; ++round) {
      const PatternField field(shown_pattern().view(), blur_px);
      std::vector<CellTask> aligned = tasks;
      align_cells(frame.view(), kBlurFull, field, {}, aligned);
      meter.clear();
      for (const CellTask& task : aligned)
        if (const auto blur = blur_of_patch(frame.view(), kBlurFull, field, {}, task)) meter.add(*blur);
      blur_px = changed_blur_px(blur_px, meter.change().value_or(0));
    }
    return blur_px;
  }
};

TEST(BlurMeter, FindsTheBlurFromNearby) {
  for (const float blur_px : {0.45F, 0.6F, 0.83F, 1.1F, 1.5F, 2.F}) {
    const Patches patches(blur_px);
    for (const float off : {0.86F, 1.F, 1.16F})
      EXPECT_NEAR(patches.find_from(off * blur_px, 2), std::hypot(blur_px, kOfSampling), 0.015F * blur_px) << off;
  }
}

TEST(BlurMeter, GoesFarInSomeRounds) {
  EXPECT_NEAR(Patches(1.5).find_from(0.55F, 6), 1.5F, 0.02F);
  EXPECT_NEAR(Patches(0.5).find_from(1.2F, 6), 0.5F, 0.02F);
}

TEST(BlurMeter, StandsNoise) {
  EXPECT_NEAR(Patches(0.8, 1500).find_from(0.72F, 3), 0.8F, 0.04F);
}

TEST(BlurMeter, FindsThePowerOfTheTone) {
  for (const double power : {0.45, 0.6, 0.75}) {
    for (const double blur_px : {0.6, 1.1})
      EXPECT_NEAR(Patches(blur_px, 400, power).find_tone(), power, 0.03) << blur_px;
  }
}

TEST(BlurMeter, StraightToneStaysStraight) {
  for (const double blur_px : {0.45, 0.8, 1.5}) EXPECT_EQ(Patches(blur_px, 1500).find_tone(), 1) << blur_px;
}

TEST(BlurMeter, KnowsNothingWithoutAPatch) {
  BlurMeter meter;
  EXPECT_FALSE(meter.change().has_value());
  EXPECT_FALSE(meter.tone_change().has_value());
}

TEST(BlurMeter, LearnsNothingFromWhatFailed) {
  CellTask failed = Patches(0.8).tasks[0];
  failed.patch.failed = true;
  EXPECT_FALSE(
      blur_of_patch(Grey16(1600, 1200).view(), kBlurFull, PatternField(shown_pattern().view(), 0.8F), {}, failed));
}

/// A look at a frame of this blur: each patch asks for half of the way, and narrow fields align none if it is wide.
struct Looks {
  float blur_px;
  std::vector<float> at{};

  BlurSeen operator()(const PatternField& field) {
    at.push_back(field.blur_sigma_px());
    const bool aligns = field.blur_sigma_px() > 0.5F * blur_px;
    return {.aligned = aligns ? 9U : 0U,
            .tried = 10,
            .blur_px = aligns ? 0.5F * (field.blur_sigma_px() + blur_px) : field.blur_sigma_px()};
  }
};

TEST(FindBlur, GoesOnUntilTheBlurRests) {
  const PatternFields fields(shown_pattern());
  Looks looks{0.8F};
  EXPECT_NEAR(find_blur(fields, std::ref(looks)), 0.8F, 0.02F);
  EXPECT_EQ(looks.at.front(), fields.usual().blur_sigma_px());
  EXPECT_LT(looks.at.size(), 8U);
}

TEST(FindBlur, StartsWiderIfMostPatchesFail) {
  const PatternFields fields(shown_pattern());
  Looks looks{2.4F};
  EXPECT_NEAR(find_blur(fields, std::ref(looks)), 2.4F, 0.06F);
}

TEST(FindBlur, EndsIfTwoFieldsAskForEachOther) {
  const PatternFields fields(shown_pattern());
  std::vector<float> at;
  const float blur_px = find_blur(fields, [&](const PatternField& tried) {
    at.push_back(tried.blur_sigma_px());
    return BlurSeen{.aligned = 10, .tried = 10, .blur_px = tried.blur_sigma_px() < 0.8F ? 0.83F : 0.77F};
  });
  EXPECT_NEAR(blur_px, 0.8F, 0.04F);
  EXPECT_LE(at.size(), 4U);
}

TEST(FindBlur, EndsWithoutPatches) {
  const PatternFields fields(shown_pattern());
  int looks = 0;
  const float blur_px = find_blur(fields, [&](const PatternField& tried) {
    ++looks;
    return BlurSeen{.blur_px = tried.blur_sigma_px()};
  });
  EXPECT_NEAR(blur_px, fields.usual().blur_sigma_px(), 0.01F);
  EXPECT_EQ(looks, 2);
}

TEST(ChangedBlur, StaysNearAndInRange) {
  EXPECT_FLOAT_EQ(changed_blur_px(1, 0.21F), 1.1F);
  EXPECT_FLOAT_EQ(changed_blur_px(1, 9), 1.5F);
  EXPECT_FLOAT_EQ(changed_blur_px(1, -9), 1 / 1.5F);
  EXPECT_FLOAT_EQ(changed_blur_px(0.4F, -9), PatternFields::kBlurMinPx);
  EXPECT_FLOAT_EQ(changed_blur_px(2.7F, 9), PatternFields::kBlurMaxPx);
}

}  // namespace
}  // namespace slsd
