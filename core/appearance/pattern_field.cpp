// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/appearance/pattern_field.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace slsd {
namespace {

constexpr int kPhases = PatternField::kSamplesPerPx;
constexpr int kSlopeMax = (1 << (PatternField::kSlopeBits - 1)) - 1;

/// Weights of a pixel, a square of side 1, in a sample and in its slope, for pixels from -reach to reach.
struct Weights {
  std::vector<float> value, slope;
};

Weights weights_of(float phase_px, float sigma_px, int reach) {
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
    weights.value.push_back(share_below(right) - share_below(left));
    weights.slope.push_back(density(left) - density(right));
  }
  return weights;
}

/// The nearest whole number, halves away from zero: std::lround(), but in vectors.
int rounded(float number) {
  const int whole = static_cast<int>(number);
  const float rest = number - static_cast<float>(whole);
  return whole + (rest >= 0.5F ? 1 : 0) - (rest <= -0.5F ? 1 : 0);
}

std::uint32_t packed(float value, float slope_u, float slope_v, float per_slope_unit) {
  const auto bits = [&](float slope) {
    const int steps = std::clamp(rounded(slope * per_slope_unit), -kSlopeMax, kSlopeMax);
    return static_cast<std::uint32_t>(steps) & ((1U << PatternField::kSlopeBits) - 1);
  };
  const auto level = static_cast<std::uint32_t>(std::clamp(rounded(value / PatternField::kValueUnit), 0, 1023));
  return level << (2 * PatternField::kSlopeBits) | bits(slope_u) << PatternField::kSlopeBits | bits(slope_v);
}

/// The samples of a row at one phase: next to each other, so that they are computed in vectors.
class RowOfPhase {
 public:
  explicit RowOfPhase(int pixels) : value_(pixels), slope_u_(pixels), slope_v_(pixels) {}

  /// @param down, down_slope  weighted along the columns, from `reach` pixels before the row
  void weigh(const float* down, const float* down_slope, const Weights& across) {
    for (auto* sums : {&value_, &slope_u_, &slope_v_}) std::ranges::fill(*sums, 0.F);
    for (std::size_t k = 0; k < across.value.size(); ++k) {
      const float weight = across.value[k], slope = across.slope[k];
      const float *const from = down + k, *const from_slope = down_slope + k;
      float *const value = value_.data(), *const slope_u = slope_u_.data(), *const slope_v = slope_v_.data();
#pragma omp simd
      for (std::size_t x = 0; x < value_.size(); ++x) {
        value[x] += weight * from[x];
        slope_u[x] += slope * from[x];
        slope_v[x] += weight * from_slope[x];
      }
    }
  }

  /// @param to  every kPhases-th of these
  void pack(float per_slope_unit, std::uint32_t* to) const {
    for (std::size_t x = 0; x < value_.size(); ++x)
      to[x * kPhases] = packed(value_[x], slope_u_[x], slope_v_[x], per_slope_unit);
  }

 private:
  std::vector<float> value_, slope_u_, slope_v_;
};

}  // namespace

PatternField::PatternField(const ImageView<std::uint8_t>& pattern, float blur_sigma_px)
    : width_((pattern.width + 2 * kBorderPx) * kPhases),
      height_((pattern.height + 2 * kBorderPx) * kPhases),
      blur_sigma_px_(blur_sigma_px),
      // No slope of a blurred function between 0 and 1 exceeds the Gaussian's peak.
      slope_unit_(1 / (blur_sigma_px * std::sqrt(2 * std::numbers::pi_v<float>) * kSlopeMax)),
      samples_(static_cast<std::size_t>(width_) * height_) {
  const int reach = static_cast<int>(std::ceil(3.5F * blur_sigma_px + 0.5F)), wide = pattern.width + 2 * kBorderPx;
  std::vector<Weights> weights;
  for (int phase = 0; phase < kPhases; ++phase)
    weights.push_back(weights_of(static_cast<float>(phase) / kPhases, blur_sigma_px, reach));
  // Along the columns first, at the pattern's width; then along the rows.
  const std::size_t padded = static_cast<std::size_t>(wide) + 2 * reach;
  std::vector<float> down(padded), down_slope(padded);
  RowOfPhase samples(wide);
  for (int j = 0; j < height_; ++j) {
    const int middle = j / kPhases - kBorderPx;
    const Weights& w = weights[j % kPhases];
    std::fill(down.begin(), down.end(), 0.F);
    std::fill(down_slope.begin(), down_slope.end(), 0.F);
    for (int k = -reach; k <= reach; ++k) {
      if (middle + k < 0 || middle + k >= pattern.height) continue;
      const std::uint8_t* row = pattern.row(middle + k);
      const float value = w.value[k + reach] / 255, slope = w.slope[k + reach] / 255;
      float *const to = down.data() + reach + kBorderPx, *const to_slope = down_slope.data() + reach + kBorderPx;
      for (int x = 0; x < pattern.width; ++x) {
        to[x] += value * static_cast<float>(row[x]);
        to_slope[x] += slope * static_cast<float>(row[x]);
      }
    }
    for (int phase = 0; phase < kPhases; ++phase) {
      samples.weigh(down.data(), down_slope.data(), weights[phase]);
      samples.pack(1 / slope_unit_, &samples_[static_cast<std::size_t>(j) * width_ + phase]);
    }
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
