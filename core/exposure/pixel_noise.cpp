// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/pixel_noise.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>

namespace slsd {
namespace {

template <class T>
float noise_of(const ImageView<T>& frame, double full) {
  constexpr int kStepRows = 13, kStep = 7, kBinBits = 10, kBins = 1 << kBinBits;
  // A bin to a level up to 10 bits; of more, as many bins.
  const int shift = std::max(0, static_cast<int>(std::bit_width(static_cast<unsigned>(full))) - kBinBits);
  std::array<int, kBins> histogram{};
  int count = 0;
  for (int y = kStepRows / 2; y < frame.height; y += kStepRows) {
    const T* row = frame.row(y);
    for (int x = 1; x + 1 < frame.width; x += kStep, ++count) {
      ++histogram[std::min(std::abs(row[x - 1] - 2 * row[x] + row[x + 1]) >> shift, kBins - 1)];
    }
  }
  int bin = 0;
  for (int below = histogram[0]; 2 * below < count; below += histogram[++bin]) {
  }
  constexpr float kMedianOfDifference = 0.6745F * 2.4495F;  // of |a - 2b + c|, sigma 1
  return static_cast<float>(bin << shift) / kMedianOfDifference;
}

}  // namespace

float pixel_noise(const GreyView& frame, double full) {
  return std::visit([&](const auto& view) { return noise_of(view, full); }, frame);
}

}  // namespace slsd
