// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/board/board_photo.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/exposure/light_levels.hpp"

namespace slsd {
namespace {

constexpr std::size_t kSamples = 20000;
constexpr double kLeftOut = 0.005;  // share of the pixels at either end

template <class T>
Image<float> light_of(const ImageView<T>& image) {
  Image<float> light(image.width, image.height);
  for (int y = 0; y < image.height; ++y) std::copy_n(image.row(y), image.width, light.row(y));
  return light;
}

struct Range {
  float least;
  float greatest;
};

Range range_of(const Image<float>& light) {
  std::vector<float> levels;
  const std::size_t step = std::max<std::size_t>(1, light.size() / kSamples);
  for (std::size_t i = 0; i < light.size(); i += step) levels.push_back(light.data()[i]);
  const auto at = [&](double share) {
    const auto place = levels.begin() + std::lround(share * static_cast<double>(levels.size() - 1));
    std::ranges::nth_element(levels, place);
    return *place;
  };
  return {at(kLeftOut), at(1 - kLeftOut)};
}

Grey8 stretched(const Image<float>& light) {
  const Range range = range_of(light);
  const float scale = 255 / std::max(1.0F, range.greatest - range.least);
  Grey8 grey(light.width(), light.height());
  std::transform(light.data(), light.data() + light.size(), grey.data(), [&](float level) {
    return static_cast<std::uint8_t>(std::clamp((level - range.least) * scale + 0.5F, 0.0F, 255.0F));
  });
  return grey;
}

}  // namespace

BoardPhoto photograph(const GreyView& image) {
  BoardPhoto photo;
  photo.light = std::visit([](const auto& view) { return light_of(view); }, image);
  photo.grey = stretched(photo.light);
  photo.full = guess_full_level(image);
  return photo;
}

Grey8 mirrored(const Grey8& image) {
  Grey8 flipped(image.width(), image.height());
  for (int y = 0; y < image.height(); ++y)
    std::reverse_copy(image.row(y), image.row(y) + image.width(), flipped.row(y));
  return flipped;
}

}  // namespace slsd
