// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/appearance/pattern_field.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "core/clones.hpp"
#include "core/lanes.hpp"

namespace slsd {
namespace {

constexpr int kPhases = PatternField::kSamplesPerPx;
constexpr int kSlopeMax = (1 << (PatternField::kSlopeBits - 1)) - 1;

/// Weights of a pixel, a square of side 1, in a sample and in its slope, for pixels from -reach to reach.
struct Weights {
  std::vector<float> value, slope;
};

Weights weights_of(float phase_px, float sigma_px, int reach, float full) {
  Weights weights;
  const auto share_below = [&](float edge) {
    return 0.5F * std::erfc(-(edge - phase_px) / (sigma_px * std::numbers::sqrt2_v<float>));
  };
  const auto density = [&](float edge) {
    const float x = (edge - phase_px) / sigma_px;
    return std::exp(-0.5F * x * x) / (sigma_px * std::sqrt(2 * std::numbers::pi_v<float>));
  };
  for (int k = -reach; k <= reach; ++k) {
    const float left = static_cast<float>(k) - 0.5F, right = static_cast<float>(k) + 0.5F;
    weights.value.push_back((share_below(right) - share_below(left)) / full);
    weights.slope.push_back((density(left) - density(right)) / full);
  }
  return weights;
}

/// Numbers computed at once: eight or four.
template <class Reals, class Integers>
struct Vectors {
  static constexpr int kCount = sizeof(Reals) / sizeof(float);

  static inline __attribute__((always_inline)) void load(const float* from, Reals& to) {
    std::memcpy(&to, from, sizeof to);
  }

  /// Rounds to the nearest whole number, halves away from zero.
  static inline __attribute__((always_inline)) void round(const Reals& from, int least, int most, Integers& to) {
    const Reals half = Reals{} + 0.5F;
    to = __builtin_convertvector(from, Integers);
    const Reals rest = from - __builtin_convertvector(to, Reals);
    to += (rest <= -half) - (rest >= half);  // a comparison that holds is -1
    const Integers low = Integers{} + least, high = Integers{} + most;
    to = to < low ? low : to;
    to = to > high ? high : to;
  }

  /// Stores the lanes of both in turn: one lane of the first, one of the second.
  static inline __attribute__((always_inline)) void store_in_turn(const Integers& first, const Integers& second,
                                                                  int count, std::uint32_t* to) {
    Integers both[2];
    if constexpr (kCount == kLanes) {
      both[0] = __builtin_shufflevector(first, second, 0, 8, 1, 9, 2, 10, 3, 11);
      both[1] = __builtin_shufflevector(first, second, 4, 12, 5, 13, 6, 14, 7, 15);
    } else {
      both[0] = __builtin_shufflevector(first, second, 0, 4, 1, 5);
      both[1] = __builtin_shufflevector(first, second, 2, 6, 3, 7);
    }
    std::memcpy(to, both, 2 * static_cast<std::size_t>(count) * sizeof *to);
  }
};
/// A row of the pattern, weighted along the columns, and what its samples take from it.
struct SampledRow {
  const float *down, *down_slope;  // from `reach` pixels before the row; kLanes more may be read
  const float *value[kPhases], *slope[kPhases];
  int taps, pixels;
  float per_slope_unit;
  std::uint32_t* to;  // kPhases samples for each pixel
};

template <class Reals>
struct Sampled {
  Reals value, slope_u, slope_v;
};

template <class Reals, class Integers>
inline __attribute__((always_inline)) void pack(const Sampled<Reals>& from, float per_slope_unit, Integers& bits) {
  using Vector = Vectors<Reals, Integers>;
  Integers level, u, v;
  Vector::round(from.value / PatternField::kValueUnit, 0, 1023, level);
  Vector::round(from.slope_u * per_slope_unit, -kSlopeMax, kSlopeMax, u);
  Vector::round(from.slope_v * per_slope_unit, -kSlopeMax, kSlopeMax, v);
  constexpr int kSlopeMask = (1 << PatternField::kSlopeBits) - 1;
  bits = level << (2 * PatternField::kSlopeBits) | (u & kSlopeMask) << PatternField::kSlopeBits | (v & kSlopeMask);
}

template <class Reals, class Integers>
inline __attribute__((always_inline)) void sample_row(const SampledRow& in) {
  static_assert(kPhases == 2);
  using Vector = Vectors<Reals, Integers>;
  for (int x = 0; x < in.pixels; x += Vector::kCount) {
    Sampled<Reals> sampled[kPhases]{};
    for (int k = 0; k < in.taps; ++k) {
      Reals down, down_slope;
      Vector::load(in.down + x + k, down), Vector::load(in.down_slope + x + k, down_slope);
      for (int phase = 0; phase < kPhases; ++phase) {
        const float weight = in.value[phase][k];
        sampled[phase].value += weight * down, sampled[phase].slope_u += in.slope[phase][k] * down;
        sampled[phase].slope_v += weight * down_slope;
      }
    }
    Integers first, second;
    pack(sampled[0], in.per_slope_unit, first), pack(sampled[1], in.per_slope_unit, second);
    Vector::store_in_turn(first, second, std::min(Vector::kCount, in.pixels - x),
                          in.to + static_cast<std::ptrdiff_t>(x) * kPhases);
  }
}

/// Rows of the pattern, weighted for a row of samples.
struct WeighedRows {
  const float* rows;  // the first
  std::size_t pitch;  // a multiple of kLanes
  const float *value, *slope;
  int taps;
  float *to, *to_slope;
};
template <class Reals, class Integers>
inline __attribute__((always_inline)) void weigh_rows(const WeighedRows& in) {
  using Vector = Vectors<Reals, Integers>;
  for (std::size_t x = 0; x < in.pitch; x += Vector::kCount) {
    Reals value{}, slope{};
    for (int k = 0; k < in.taps; ++k) {
      Reals levels;
      Vector::load(in.rows + k * in.pitch + x, levels);
      value += in.value[k] * levels, slope += in.slope[k] * levels;
    }
    std::memcpy(in.to + x, &value, sizeof value), std::memcpy(in.to_slope + x, &slope, sizeof slope);
  }
}

}  // namespace

PatternField::PatternField(const ImageView<std::uint8_t>& pattern, float blur_sigma_px)
    : width_((pattern.width + 2 * kBorderPx) * kPhases),
      height_((pattern.height + 2 * kBorderPx) * kPhases),
      blur_sigma_px_(blur_sigma_px),
      // No slope of a blurred function between 0 and 1 exceeds the Gaussian's peak.
      slope_unit_(1 / (blur_sigma_px * std::sqrt(2 * std::numbers::pi_v<float>) * kSlopeMax)),
      samples_(std::make_unique_for_overwrite<std::uint32_t[]>(static_cast<std::size_t>(width_) * height_)) {
  const int reach = static_cast<int>(std::ceil(3.5F * blur_sigma_px + 0.5F)), wide = pattern.width + 2 * kBorderPx;
  std::vector<Weights> weights;  // along the rows, then along the columns of grey levels
  for (const float full : {1.F, 255.F})
    for (int phase = 0; phase < kPhases; ++phase)
      weights.push_back(weights_of(static_cast<float>(phase) / kPhases, blur_sigma_px, reach, full));
  // The pattern with a dark border, as far as any sample's weights reach.
  const std::size_t pitch = (static_cast<std::size_t>(wide) + 2 * reach + 2 * kLanes) / kLanes * kLanes;
  const int high = pattern.height + 2 * kBorderPx + 2 * reach, border = kBorderPx + reach;
  std::vector<float> dark(pitch * high, 0);
  for (int y = 0; y < pattern.height; ++y)
    std::copy_n(pattern.row(y), pattern.width, dark.data() + (y + border) * pitch + border);
  // Along the columns first, at the pattern's width; then along the rows.
  std::vector<float> down(pitch), down_slope(pitch);
  SampledRow row{down.data(), down_slope.data(), {}, {}, 2 * reach + 1, wide, 1 / slope_unit_, nullptr};
  for (int phase = 0; phase < kPhases; ++phase)
    row.value[phase] = weights[phase].value.data(), row.slope[phase] = weights[phase].slope.data();
  const Weights* const along = weights.data() + kPhases;
  for (int j = 0; j < height_; ++j) {
    const Weights& w = along[j % kPhases];
    ClonedExactly<weigh_rows<Lanes, IntLanes>, weigh_rows<FourLanes, FourIntLanes>>::call(
        {dark.data() + (j / kPhases) * pitch, pitch, w.value.data(), w.slope.data(), row.taps, down.data(),
         down_slope.data()});
    row.to = samples_.get() + static_cast<std::ptrdiff_t>(j) * width_;
    ClonedExactly<sample_row<Lanes, IntLanes>, sample_row<FourLanes, FourIntLanes>>::call(row);
  }
}

const PatternField& PatternFields::rung(std::size_t rung) const {
  std::call_once(made_[rung], [&] { fields_[rung].emplace(pattern_.view(), kLadderPx[rung]); });
  return *fields_[rung];
}

const PatternField& PatternFields::nearest(float blur_px) const {
  const auto off = [&](float known) { return std::abs(known - blur_px); };
  return rung(static_cast<std::size_t>(std::ranges::min_element(kLadderPx, {}, off) - kLadderPx.begin()));
}

std::shared_ptr<const PatternField> PatternFields::at(float blur_px, float share) const {
  const float blur = std::clamp(std::exp(std::round(std::log(blur_px) / share) * share), kBlurMinPx, kBlurMaxPx);
  constexpr std::size_t kCallsOfSomeFrames = 24;
  const std::lock_guard lock(mutex_);
  const std::size_t call = calls_++;
  std::erase_if(kept_, [&](const Kept& kept) { return call - kept.asked_for > kCallsOfSomeFrames; });
  const auto known = std::ranges::find(kept_, blur, [](const Kept& kept) { return kept.field->blur_sigma_px(); });
  if (known != kept_.end()) {
    std::rotate(known, known + 1, kept_.end());
  } else {
    if (kept_.size() == kKept) kept_.erase(kept_.begin());
    kept_.push_back({std::make_shared<const PatternField>(pattern_.view(), blur), 0});
  }
  kept_.back().asked_for = call;
  return kept_.back().field;
}

}  // namespace slsd
