// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/files/bayer.hpp"

#include <algorithm>
#include <array>
#include <span>
#include <utility>
#include <vector>

namespace slsd {
namespace {

constexpr std::array<std::pair<std::string_view, BayerPattern>, 5> kNames{{{"none", BayerPattern::kNone},
                                                                           {"RGGB", BayerPattern::kRggb},
                                                                           {"BGGR", BayerPattern::kBggr},
                                                                           {"GRBG", BayerPattern::kGrbg},
                                                                           {"GBRG", BayerPattern::kGbrg}}};

/// Mirrored without repeating the edge: -1 is 1, size is size - 2.
int mirrored(int i, int size) {
  return i < 0 ? -i : (i >= size ? 2 * size - 2 - i : i);
}

template <class T>
void add_columns(const ImageView<T>& mosaic, int y, std::span<std::uint32_t> sums) {
  const T* above = mosaic.row(mirrored(y - 1, mosaic.height));
  const T* here = mosaic.row(y);
  const T* below = mosaic.row(mirrored(y + 1, mosaic.height));
  for (int x = 0; x < mosaic.width; ++x) sums[x] = above[x] + 2u * here[x] + below[x];
}

template <class T>
void binomial(const ImageView<T>& mosaic, Image<T>& grey, std::span<std::uint32_t> sums) {
  const int width = mosaic.width;
  const auto blend = [&](int left, int x, int right) {
    return static_cast<T>((sums[left] + 2 * sums[x] + sums[right] + 8) / 16);
  };
  for (int y = 0; y < mosaic.height; ++y) {
    add_columns(mosaic, y, sums);
    T* row = grey.row(y);
    for (int x = 1; x + 1 < width; ++x) row[x] = blend(x - 1, x, x + 1);
    row[0] = blend(1, 0, 1);
    row[width - 1] = blend(width - 2, width - 1, width - 2);
  }
}

template <class T>
Image<T> binomial(const Image<T>& mosaic) {
  Image<T> grey(mosaic.width(), mosaic.height());
  std::vector<std::uint32_t> sums(static_cast<std::size_t>(mosaic.width()));
  binomial<T>(mosaic.view(), grey, sums);
  return grey;
}

}  // namespace

std::optional<BayerPattern> parse_bayer_pattern(std::string_view name) {
  const auto* found =
      std::find_if(kNames.begin(), kNames.end(), [&](const auto& entry) { return entry.first == name; });
  if (found == kNames.end()) return std::nullopt;
  return found->second;
}

std::string_view to_string(BayerPattern pattern) {
  const auto* found =
      std::find_if(kNames.begin(), kNames.end(), [&](const auto& entry) { return entry.second == pattern; });
  return found->first;
}

Grey8 grey_from_mosaic(const Grey8& mosaic) {
  return binomial(mosaic);
}
Grey16 grey_from_mosaic(const Grey16& mosaic) {
  return binomial(mosaic);
}
void grey_from_mosaic(const ImageView<std::uint8_t>& mosaic, Grey8& grey, std::span<std::uint32_t> sums) {
  binomial(mosaic, grey, sums);
}
void grey_from_mosaic(const ImageView<std::uint16_t>& mosaic, Grey16& grey, std::span<std::uint32_t> sums) {
  binomial(mosaic, grey, sums);
}

}  // namespace slsd
