// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/paper/binarize.hpp"

#include <algorithm>
#include <limits>
#include <vector>

namespace slsd {
namespace {

constexpr double kIgnoredShare = 0.001;  // at each end of the histogram: hot pixels and reflections

struct Range {
  int low = 0, high = 0;
};

template <class T>
std::vector<std::uint32_t> count_values(const ImageView<T>& frame) {
  std::vector<std::uint32_t> counts(std::size_t{1} + std::numeric_limits<T>::max());
  for (int y = 0; y < frame.height; ++y) {
    for (int x = 0; x < frame.width; ++x) ++counts[frame.at(x, y)];
  }
  return counts;
}

Range contrast_of(const std::vector<std::uint32_t>& counts, double pixels) {
  const auto passes = [ignored = kIgnoredShare * pixels, sum = 0.](std::uint32_t count) mutable {
    sum += count;
    return sum > ignored;
  };
  const auto low = std::find_if(counts.begin(), counts.end(), passes);
  const auto high = std::find_if(counts.rbegin(), counts.rend(), passes);
  return {static_cast<int>(low - counts.begin()), static_cast<int>(counts.rend() - high) - 1};
}

template <class T>
void stretch(const ImageView<T>& frame, Grey8& stretched) {
  const Range range = contrast_of(count_values(frame), double(frame.width) * frame.height);
  const double gain = range.high > range.low ? 255. / (range.high - range.low) : 0;
  std::vector<std::uint8_t> grey(std::size_t{1} + std::numeric_limits<T>::max());
  for (std::size_t value = 0; value < grey.size(); ++value) {
    grey[value] = static_cast<std::uint8_t>(std::clamp(gain * (static_cast<double>(value) - range.low), 0., 255.));
  }
  for (int y = 0; y < frame.height; ++y) {
    std::transform(frame.row(y), frame.row(y) + frame.width, stretched.row(y), [&](T value) { return grey[value]; });
  }
}

std::uint8_t median(std::uint8_t a, std::uint8_t b, std::uint8_t c) {
  return std::max(std::min(a, b), std::min(std::max(a, b), c));
}

// Median of nine: the median of three values, which are the greatest of the columns' minima, the median of their
// medians, and the least of their maxima.
std::uint8_t median_around(const std::array<const std::uint8_t*, 3>& rows, const std::array<int, 3>& columns) {
  std::uint8_t greatest_least = 0, least_greatest = 255;
  std::array<std::uint8_t, 3> middle{};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint8_t a = rows[0][columns[i]], b = rows[1][columns[i]], c = rows[2][columns[i]];
    greatest_least = std::max(greatest_least, std::min({a, b, c}));
    least_greatest = std::min(least_greatest, std::max({a, b, c}));
    middle[i] = median(a, b, c);
  }
  return median(greatest_least, median(middle[0], middle[1], middle[2]), least_greatest);
}

Grey8 median_3x3(const Grey8& image) {
  Grey8 result(image.width(), image.height());
  for (int y = 0; y < image.height(); ++y) {
    const std::array<const std::uint8_t*, 3> rows{image.row(std::max(y - 1, 0)), image.row(y),
                                                  image.row(std::min(y + 1, image.height() - 1))};
    for (int x = 0; x < image.width(); ++x) {
      result.at(x, y) = median_around(rows, {std::max(x - 1, 0), x, std::min(x + 1, image.width() - 1)});
    }
  }
  return result;
}

Histogram histogram_of(const Grey8& image) {
  Histogram histogram{};
  std::for_each(image.data(), image.data() + image.size(), [&](std::uint8_t value) { ++histogram[value]; });
  return histogram;
}

}  // namespace

int otsu_threshold(const Histogram& histogram) {
  double pixels = 0, sum = 0;
  for (int value = 0; value < 256; ++value) {
    pixels += histogram[value];
    sum += double(value) * histogram[value];
  }
  double dark_pixels = 0, dark_sum = 0, greatest = 0;
  int threshold = 0;
  for (int value = 0; value < 256; ++value) {
    dark_pixels += histogram[value];
    dark_sum += double(value) * histogram[value];
    const double lit_pixels = pixels - dark_pixels;
    if (dark_pixels == 0 || lit_pixels == 0) continue;
    const double apart = dark_sum / dark_pixels - (sum - dark_sum) / lit_pixels;
    const double variance_between = dark_pixels * lit_pixels * apart * apart;
    if (variance_between > greatest) {
      greatest = variance_between;
      threshold = value;
    }
  }
  return threshold;
}

Mask binarize_paper(const GreyView& frame) {
  Grey8 mask;
  std::visit(
      [&](const auto& view) {
        mask = Grey8(view.width, view.height);
        stretch(view, mask);
      },
      frame);
  mask = median_3x3(mask);
  const int threshold = otsu_threshold(histogram_of(mask));
  std::transform(mask.data(), mask.data() + mask.size(), mask.data(),
                 [&](std::uint8_t value) { return value > threshold ? std::uint8_t{255} : std::uint8_t{0}; });
  return Mask(mask.view());
}

}  // namespace slsd
