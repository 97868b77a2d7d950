// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/regions/sharpen.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/clones.hpp"

namespace slsd {
namespace {

constexpr float kLeftPx = 1;  // remaining blur, as of a camera in focus
constexpr float kNoiseShare = 0.1F;
constexpr float kReach = 6;  // in standard deviations; a shorter kernel would change the filter
constexpr float kHighest = 65535;

/// The filter's weights from its middle outwards; the whole kernel sums to 1.
std::vector<float> wiener_weights(float blur_px) {
  constexpr int kSteps = 512;
  const int reach = static_cast<int>(std::ceil(kReach * blur_px)) + 1;
  std::vector<float> weights;
  double sum = 0;
  for (int i = 0; i <= reach; ++i) {
    double weight = 0;
    for (int step = 0; step < kSteps; ++step) {
      const double w = (step + 0.5) * std::numbers::pi / kSteps;
      const double blur = std::exp(-0.5 * w * w * blur_px * blur_px), left = std::exp(-0.5 * w * w * kLeftPx * kLeftPx);
      weight += left * blur / (blur * blur + kNoiseShare * kNoiseShare) * std::cos(w * i) / kSteps;
    }
    weights.push_back(static_cast<float>(weight));
    sum += i == 0 ? weight : 2 * weight;
  }
  for (float& weight : weights) weight /= static_cast<float>(sum);
  return weights;
}

/// @param padded  the row with a border on both sides as wide as the filter's reach
inline __attribute__((always_inline)) void filter_row(const float* padded, const float* weights, int reach, int width,
                                                      float* filtered) {
  const float* middle = padded + reach;
  for (int x = 0; x < width; ++x) filtered[x] = weights[0] * middle[x];
  for (int i = 1; i <= reach; ++i) {
    for (int x = 0; x < width; ++x) filtered[x] += weights[i] * (middle[x - i] + middle[x + i]);
  }
}

inline __attribute__((always_inline)) void add_rows(const float* above, const float* below, float weight, int width,
                                                    float* sum) {
  for (int x = 0; x < width; ++x) sum[x] += weight * (above[x] + below[x]);
}

}  // namespace

template <class T>
void Sharpener::filter(const ImageView<T>& frame, float scale) {
  const int width = frame.width, height = frame.height, reach = static_cast<int>(weights_.size()) - 1;
  const int kept = 2 * reach + 1;
  if (filtered_.width() != width || filtered_.height() != height) filtered_ = Grey16(width, height);
  padded_.resize(width + 2 * static_cast<std::size_t>(reach));
  rows_.resize(static_cast<std::size_t>(kept) * width);
  sum_.resize(width);
  // Keeps as many filtered rows as a column's filter needs.
  const auto kept_row = [&](int y) {
    return rows_.data() + static_cast<std::ptrdiff_t>(std::clamp(y, 0, height - 1) % kept) * width;
  };
  int next = 0;
  for (int y = 0; y < height; ++y) {
    for (; next <= std::min(y + reach, height - 1); ++next) {
      const T* row = frame.row(next);
      for (int x = 0; x < width; ++x) padded_[x + reach] = scale * static_cast<float>(row[x]);
      std::fill_n(padded_.begin(), reach, padded_[reach]);
      std::fill_n(padded_.end() - reach, reach, padded_[reach + width - 1]);
      Cloned<filter_row>::call(padded_.data(), weights_.data(), reach, width, kept_row(next));
    }
    std::transform(kept_row(y), kept_row(y) + width, sum_.begin(), [&](float value) { return weights_[0] * value; });
    for (int i = 1; i <= reach; ++i)
      Cloned<add_rows>::call(kept_row(y - i), kept_row(y + i), weights_[i], width, sum_.data());
    std::uint16_t* out = filtered_.row(y);
    for (int x = 0; x < width; ++x) out[x] = static_cast<std::uint16_t>(std::clamp(sum_[x], 0.F, kHighest));
  }
}

const Grey16& Sharpener::sharpen(const GreyView& frame, float blur_px, double full) {
  weights_ = wiener_weights(blur_px);
  std::visit([&](const auto& view) { filter(view, kSharpenedFull / static_cast<float>(full)); }, frame);
  return filtered_;
}

const Grey16& Sharpener::smooth(const GreyView& frame, double full) {
  weights_ = {0.5F, 0.25F};
  std::visit([&](const auto& view) { filter(view, kSharpenedFull / static_cast<float>(full)); }, frame);
  return filtered_;
}

}  // namespace slsd
