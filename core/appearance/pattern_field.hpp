// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "core/image.hpp"

namespace slsd {

/// The pattern's light on a surface: square pixels, blurred, with slopes, in two samples for each projector pixel. A
/// single load gives the nearest sample with its slopes, and these give the value anywhere to 1 % of the contrast. Half
/// of that error is as if the blur were wider by 0.02 px^2.
///
/// Made once for a pattern and a blur, with 16 bytes for each projector pixel, and shared by all aligners.
/// @thread reentrant
class PatternField {
 public:
  static constexpr int kSamplesPerPx = 2;
  static constexpr int kBorderPx = 8;  ///< dark border around the pattern

  /// @param pattern        the projector's picture; 255 is light 1
  /// @param blur_sigma_px  standard deviation of a Gaussian, projector px, 0.3 to 2.8
  PatternField(const ImageView<std::uint8_t>& pattern, float blur_sigma_px);

  /// Light at a sample, 0 to 1, and its slopes, per projector px.
  struct Sample {
    float value, slope_u, slope_v;
  };
  /// @param u, v  projector px; what lies outside the pattern is dark
  [[nodiscard]] Sample at(float u, float v) const {
    const auto place = [](float px, int count) {
      return std::clamp((px + kBorderPx) * kSamplesPerPx, 0.F, static_cast<float>(count - 1));
    };
    const float i = place(u, width_), j = place(v, height_);
    // Neither is negative. NOLINTNEXTLINE(bugprone-incorrect-roundings)
    const int column = static_cast<int>(i + 0.5F), row = static_cast<int>(j + 0.5F);
    const std::uint32_t bits = samples_[static_cast<std::size_t>(row) * width_ + column];
    const auto slope_of = [&](int left) {
      return static_cast<float>(static_cast<std::int32_t>(bits << left) >> (32 - kSlopeBits)) * slope_unit_;
    };
    Sample sample{static_cast<float>(bits >> (2 * kSlopeBits)) * kValueUnit, slope_of(32 - 2 * kSlopeBits),
                  slope_of(32 - kSlopeBits)};
    sample.value +=
        (sample.slope_u * (i - static_cast<float>(column)) + sample.slope_v * (j - static_cast<float>(row))) /
        kSamplesPerPx;
    return sample;
  }

  /// A sample: 10 bits of the value, 11 of each slope.
  [[nodiscard]] const std::uint32_t* samples() const { return samples_.get(); }
  [[nodiscard]] int width() const { return width_; }  ///< samples
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] float slope_unit() const { return slope_unit_; }  ///< per projector px, of one step of a slope's bits
  [[nodiscard]] float blur_sigma_px() const { return blur_sigma_px_; }

  static constexpr float kValueUnit = 1.F / 1023;
  static constexpr int kSlopeBits = 11;

 private:
  int width_, height_;
  float blur_sigma_px_, slope_unit_;
  std::unique_ptr<std::uint32_t[]> samples_;
};

/// The pattern at any blur. Makes each field on first use: a ladder of blurs that stay, and between them those that
/// were asked for lately.
/// @thread thread-safe
class PatternFields {
 public:
  static constexpr float kBlurMinPx = 0.35F, kBlurMaxPx = 2.8F;
  static constexpr std::array<float, 8> kLadderPx{0.42F, 0.55F, 0.72F, 0.95F, 1.25F, 1.65F, 2.15F, 2.8F};
  static constexpr std::size_t kUsualRung = 1;
  static constexpr std::size_t kKept = 8;  ///< largest number of fields between those of the ladder

  explicit PatternFields(Grey8 pattern) : pattern_(std::move(pattern)) {}
  /// Returns the field of the ladder that suits projectors and cameras in focus.
  [[nodiscard]] const PatternField& usual() const { return rung(kUsualRung); }
  /// Returns a field of the ladder.
  [[nodiscard]] const PatternField& rung(std::size_t rung) const;
  /// Returns the field of the ladder with the nearest blur, a standard deviation in projector px.
  [[nodiscard]] const PatternField& nearest(float blur_px) const;
  /// Returns the field at a blur, rounded to a share of itself: blurs that differ by less share a field.
  [[nodiscard]] std::shared_ptr<const PatternField> at(float blur_px, float share = 0.01F) const;

 private:
  Grey8 pattern_;
  mutable std::array<std::once_flag, kLadderPx.size()> made_;
  mutable std::array<std::optional<PatternField>, kLadderPx.size()> fields_;
  struct Kept {
    std::shared_ptr<const PatternField> field;
    std::size_t asked_for;  // when, in calls of at()
  };
  mutable std::mutex mutex_;        // of those below
  mutable std::vector<Kept> kept_;  // the last one asked for comes last
  mutable std::size_t calls_ = 0;
};

}  // namespace slsd
