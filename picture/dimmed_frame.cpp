// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/dimmed_frame.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "picture/canvas.hpp"

namespace slsd {
namespace {

constexpr double kBrightShare = 0.99;  // this share of pixels is no brighter than full brightness
constexpr double kDim = 0.46;
constexpr Rgb kFooter{24, 27, 34};

template <class T>
double bright_level(const ImageView<T>& frame) {
  std::vector<std::uint32_t> histogram(std::size_t{1} << (8 * sizeof(T)));
  for (int y = 0; y < frame.height; ++y) {
    for (int x = 0; x < frame.width; ++x) ++histogram[frame.at(x, y)];
  }
  double left = kBrightShare * frame.width * frame.height;
  std::size_t level = 0;
  while (level + 1 < histogram.size() && (left -= histogram[level]) > 0) ++level;
  return std::max<double>(static_cast<double>(level), 1.0);
}

template <class T>
Rgb dimmed(T value, double bright) {
  const double grey = 255.0 * kDim * std::sqrt(std::min(1.0, value / bright));
  const auto level = static_cast<std::uint8_t>(std::lround(grey));
  return {level, level, level};
}

template <class T>
ColourImage dimmed_frame_of(const ImageView<T>& frame, int scale, int footer_px) {
  const double bright = bright_level(frame);
  ColourImage picture(frame.width * scale, frame.height * scale + footer_px, kFooter);
  for (int y = 0; y < frame.height * scale; ++y) {
    for (int x = 0; x < picture.width(); ++x) picture.at(x, y) = dimmed(frame.at(x / scale, y / scale), bright);
  }
  return picture;
}

}  // namespace

ColourImage dimmed_frame(const GreyView& frame, int scale, int footer_px) {
  return std::visit([&](const auto& view) { return dimmed_frame_of(view, scale, footer_px); }, frame);
}

}  // namespace slsd
