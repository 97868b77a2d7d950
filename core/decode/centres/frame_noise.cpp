// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/frame_noise.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace slsd {
namespace {

constexpr int kStep = 11;  // from sample to sample
constexpr int kLevels = 16;
constexpr int kBins = 256;   // of a difference
constexpr int kEnough = 60;  // samples of a level
/// The lower quartile of |a - 2 b + c|, each normal with variance 1: that of the sum is 6.
constexpr float kOfSigma = 0.3186F * 2.4495F;

/// The difference below which a quarter of them lies, to fractions of a bin: 0 stands for 0 to 1/2, k for k -+ 1/2.
float lower_quartile(const std::array<int, kBins>& histogram, int count) {
  float below = 0;
  const float quarter = 0.25F * static_cast<float>(count);
  for (int bin = 0; bin < kBins; ++bin) {
    const auto here = static_cast<float>(histogram[bin]);
    if (below + here >= quarter) {
      const float share = (quarter - below) / here;
      return bin == 0 ? 0.5F * share : static_cast<float>(bin) - 0.5F + share;
    }
    below += here;
  }
  return kBins;
}

template <class T>
FrameNoise measure(const ImageView<T>& frame, double full) {
  const float levels_per_step = static_cast<float>(full / kLevels);
  const int unit = std::max(1, static_cast<int>(full / 1024));
  std::array<std::array<int, kBins>, kLevels> histograms{};
  std::array<int, kLevels> counts{};
  for (int y = kStep / 2; y < frame.height; y += kStep) {
    const T* row = frame.row(y);
    for (int x = 1; x + 1 < frame.width; x += kStep) {
      const int before = row[x - 1], here = row[x], after = row[x + 1];
      if (std::max({before, here, after}) >= full) continue;
      const auto mean = static_cast<float>(before + 2 * here + after) * 0.25F;
      const int level = std::min(static_cast<int>(mean / levels_per_step), kLevels - 1);
      ++histograms[level][std::min(std::abs(before - 2 * here + after) / unit, kBins - 1)];
      ++counts[level];
    }
  }
  // Rounding to whole levels alone is a noise of 1/12.
  FrameNoise noise{.dark_variance = 1 / 12.F};
  float darkest = -1, slope = std::numeric_limits<float>::max();
  for (int level = 0; level < kLevels; ++level) {
    if (counts[level] < kEnough) continue;
    const float sigma = lower_quartile(histograms[level], counts[level]) * static_cast<float>(unit) / kOfSigma;
    const float grey = (static_cast<float>(level) + 0.5F) * levels_per_step;
    if (darkest < 0) {
      darkest = grey;
      noise.dark_variance = std::max(noise.dark_variance, sigma * sigma);
    } else {
      slope = std::min(slope, (sigma * sigma - noise.dark_variance) / (grey - darkest));
    }
  }
  if (slope < std::numeric_limits<float>::max()) noise.variance_per_level = std::max(0.F, slope);
  return noise;
}

}  // namespace

FrameNoise measure_noise(const GreyView& frame, double full) {
  return std::visit([&](const auto& view) { return measure(view, full); }, frame);
}

}  // namespace slsd
