// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/dense_map.hpp"

#include <cstring>

namespace slsd {

std::string_view to_string(DensePixel pixel) {
  constexpr std::array<std::string_view, kDensePixelCount> kNames{
      "measured",        "not_reached", "no_support",  "saturated", "out_of_depth_range", "occluded", "unlit",
      "small_component", "at_an_edge",  "outside_box", "thinned",   "behind_plane"};
  return kNames[static_cast<std::size_t>(pixel)];
}

void DenseMap::take_part(const DenseMap& measured, int left, int top, const PixelRectangle& of_frame, int to_width,
                         int to_height) {
  if (width != to_width || height != to_height) resize(to_width, to_height);
  // Outside the last part, all is clear already.
  for (int y = part.top; y < part.bottom; ++y)
    clear(static_cast<std::size_t>(y) * width + part.left, part.right - part.left, DensePixel::kOutsideBox);
  part = of_frame;
  for (int y = part.top; y < part.bottom; ++y) {
    const auto from = static_cast<std::ptrdiff_t>(y - top) * measured.width + part.left - left,
               to = static_cast<std::ptrdiff_t>(y) * width + part.left;
    const auto copy = [&](const auto& values, auto& here) {
      std::copy_n(values.begin() + from, part.right - part.left, here.begin() + to);
    };
    copy(measured.depth_mm, depth_mm), copy(measured.sigma_mm, sigma_mm), copy(measured.intensity, intensity);
    copy(measured.pixels, pixels), copy(measured.firm, firm);
  }
  count_pixels();
}

void DenseMap::count_pixels() {
  constexpr std::size_t kAtOnce = sizeof(std::uint64_t);
  constexpr std::uint64_t kOnes = 0x0101010101010101U;
  counts.fill(0);
  const auto count = static_cast<std::size_t>(part.right - part.left);
  for (int y = part.top; y < part.bottom; ++y) {
    const DensePixel* const row = pixels.data() + static_cast<std::size_t>(y) * width + part.left;
    std::size_t i = 0;
    // Most pixels have the status of those beside them.
    for (; i + kAtOnce <= count; i += kAtOnce) {
      std::uint64_t eight;
      std::memcpy(&eight, row + i, kAtOnce);
      const auto first = static_cast<std::size_t>(row[i]);
      if (eight == kOnes * first) {
        counts[first] += kAtOnce;
      } else {
        for (std::size_t k = i; k < i + kAtOnce; ++k) ++counts[static_cast<std::size_t>(row[k])];
      }
    }
    for (; i < count; ++i) ++counts[static_cast<std::size_t>(row[i])];
  }
  counts[static_cast<std::size_t>(DensePixel::kOutsideBox)] +=
      static_cast<std::uint32_t>(pixels.size() - count * static_cast<std::size_t>(part.bottom - part.top));
}

}  // namespace slsd
