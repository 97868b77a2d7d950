// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/frame_noise.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <span>
#include <type_traits>

namespace slsd {
namespace {

constexpr int kStep = 11;  // distance between samples, or more in a large frame
constexpr int kSamplesMax = 20000;
constexpr int kGreys = 16;
constexpr int kDifferences = 256;  // number of histogram bins for differences
constexpr int kEnough = 60;        // smallest number of samples of a level
constexpr int kFlatShare = 8, kFlatMin = 24;
/// The median of |a - 2 b + c| for independent a, b and c, normal with variance 1: the sum has variance 6.
constexpr float kOfSigma = 0.6745F * 2.4495F;

using Histogram = std::array<int, kDifferences>;
using Histograms = std::array<Histogram, kGreys>;

/// The median difference, interpolated within a bin: 0 covers 0 to 1/2, k covers k -+ 1/2.
float median(const Histogram& histogram, int count) {
  float below = 0;
  const float half = 0.5F * static_cast<float>(count);
  for (int bin = 0; bin < kDifferences; ++bin) {
    const auto here = static_cast<float>(histogram[bin]);
    if (below + here >= half) {
      const float share = (half - below) / here;
      return bin == 0 ? 0.5F * share : static_cast<float>(bin) - 0.5F + share;
    }
    below += here;
  }
  return kDifferences;
}

/// Three pixels of each of three rows. The outer rows show how flat the image is there; their noise is independent of
/// the middle row's, which is measured.
struct Sample {
  std::uint8_t level, unevenness, difference;
};
using Samples = std::array<Sample, kSamplesMax>;

/// Grey levels for each bin of differences.
template <class T>
int unit_of(double full) {
  return std::is_same_v<T, std::uint8_t> ? 1 : std::max(1, static_cast<int>(full / 1024));
}

/// A sample of a frame's unsaturated pixels.
template <class T>
std::size_t take_samples(const ImageView<T>& frame, double full, Samples& samples) {
  const auto per_level = static_cast<float>(kGreys / full);
  const int unit = unit_of<T>(full);
  int step = kStep;
  const auto taken = [&] { return (frame.width / step + 1) * (frame.height / step + 1); };
  while (taken() > kSamplesMax) ++step;
  std::size_t count = 0;
  for (int y = step / 2; y + 1 < frame.height; y += step) {
    for (int x = 1; x + 1 < frame.width; x += step) {
      const T *above = frame.row(y - 1) + x, *here = frame.row(y) + x, *below = frame.row(y + 1) + x;
      const auto bend = [](const T* at) { return at[-1] - 2 * at[0] + at[1]; };
      const auto sum = [](const T* at) { return at[-1] + 2 * at[0] + at[1]; };
      const auto rise = [](const T* at) { return at[1] - at[-1]; };
      const auto greatest = [](const T* at) { return std::max({at[-1], at[0], at[1]}); };
      if (std::max({greatest(above), greatest(here), greatest(below)}) >= full) continue;
      const int uneven = std::abs(bend(above)) + std::abs(bend(below)) + std::abs(sum(above) - sum(below)) / 2 +
                         std::abs(rise(above) + rise(below));
      const float mean = static_cast<float>(sum(above) + sum(below)) / 8;
      const auto bin = [&](int difference) {
        return static_cast<std::uint8_t>(std::min(difference / unit, kDifferences - 1));
      };
      samples[count++] = {static_cast<std::uint8_t>(std::min(static_cast<int>(mean * per_level), kGreys - 1)),
                          bin(uneven), bin(std::abs(bend(here)))};
    }
  }
  return count;
}

template <class T>
FrameNoise measure(const ImageView<T>& frame, double full) {
  Samples all;
  const std::span samples = std::span(all).first(take_samples(frame, full, all));
  Histograms unevenness{}, differences{};
  std::array<int, kGreys> counts{}, flattest{}, flat{};
  for (const Sample& sample : samples) ++unevenness[sample.level][sample.unevenness], ++counts[sample.level];
  for (int level = 0; level < kGreys; ++level) {
    const int wanted = std::min(std::max(counts[level] / kFlatShare, kFlatMin), counts[level]);
    for (int below = unevenness[level][0]; below < wanted; below += unevenness[level][++flattest[level]]) {
    }
  }
  for (const Sample& sample : samples)
    if (sample.unevenness <= flattest[sample.level])
      ++differences[sample.level][sample.difference], ++flat[sample.level];
  constexpr float kOfRounding = 1 / 12.F;
  const float step = static_cast<float>(full / kGreys), unit = static_cast<float>(unit_of<T>(full));
  FrameNoise noise{.dark_variance = kOfRounding};
  float darkest = -1, variance_there = 0, slope = std::numeric_limits<float>::max();
  for (int level = 0; level < kGreys; ++level) {
    if (counts[level] < kEnough) continue;
    const float sigma = median(differences[level], flat[level]) * unit / kOfSigma;
    const float grey = (static_cast<float>(level) + 0.5F) * step, variance = std::max(kOfRounding, sigma * sigma);
    if (darkest < 0) {
      darkest = grey, variance_there = variance;
    } else {
      slope = std::min(slope, (variance - variance_there) / (grey - darkest));
    }
  }
  if (darkest < 0) return noise;
  if (slope < std::numeric_limits<float>::max()) noise.variance_per_level = std::max(0.F, slope);
  noise.dark_variance = std::max(kOfRounding, variance_there - noise.variance_per_level * darkest);
  return noise;
}

}  // namespace

FrameNoise measure_noise(const GreyView& frame, double full) {
  return std::visit([&](const auto& view) { return measure(view, full); }, frame);
}

}  // namespace slsd
