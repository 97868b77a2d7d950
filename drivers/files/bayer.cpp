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
ColourFrame mean_colours(const ImageView<T>& mosaic, BayerPattern pattern) {
  constexpr std::array<std::uint32_t, 3> kWeights{1, 2, 1}, kSums{4, 8, 4};
  const std::string_view names = to_string(pattern);
  std::array<std::size_t, 4> colour_at{};  // of the mosaic's first two pixels in its first two rows
  for (std::size_t i = 0; i < colour_at.size(); ++i) colour_at[i] = std::string_view("RGB").find(names[i]);
  ColourFrame colours(mosaic.width, mosaic.height);
  for (int y = 0; y < mosaic.height; ++y) {
    for (int x = 0; x < mosaic.width; ++x) {
      std::array<std::uint32_t, 3> sums{};
      for (int down = -1; down <= 1; ++down) {
        const T* const row = mosaic.row(mirrored(y + down, mosaic.height));
        for (int right = -1; right <= 1; ++right) {
          const std::size_t place =
              2 * static_cast<std::size_t>((y + down) & 1) + static_cast<std::size_t>((x + right) & 1);
          sums[colour_at[place]] += kWeights[down + 1] * kWeights[right + 1] * row[mirrored(x + right, mosaic.width)];
        }
      }
      for (std::size_t i = 0; i < sums.size(); ++i)
        colours.at(x, y)[i] = static_cast<std::uint16_t>((sums[i] + kSums[i] / 2) / kSums[i]);
    }
  }
  return colours;
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

ColourFrame colours_from_mosaic(const GreyView& mosaic, BayerPattern pattern) {
  return std::visit([pattern](const auto& pixels) { return mean_colours(pixels, pattern); }, mosaic);
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
