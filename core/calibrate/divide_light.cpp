// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/divide_light.hpp"

#include <algorithm>
#include <limits>
#include <string>

namespace slsd {
namespace {

constexpr float kAsBrightAsWhite = 50000;
/// Of the brightest of the white image: below it noise is all there is.
constexpr float kDarkShare = 0.02F;

template <class T>
T brightest(const ImageView<T>& image) {
  T most = 0;
  for (int y = 0; y < image.height; ++y)
    most = std::max(most, *std::max_element(image.row(y), image.row(y) + image.width));
  return most;
}

template <class T, class U>
Grey16 divide(const ImageView<T>& pattern, const ImageView<U>& white) {
  const float dark = std::max(2.F, kDarkShare * static_cast<float>(brightest(white)));
  // Two images of one camera have the same depth; if not, full levels are what they have in common.
  const float scale = kAsBrightAsWhite * static_cast<float>(std::numeric_limits<U>::max()) /
                      static_cast<float>(std::numeric_limits<T>::max());
  Grey16 quotient(white.width, white.height);
  for (int y = 0; y < white.height; ++y) {
    for (int x = 0; x < white.width; ++x) {
      const auto light = static_cast<float>(white.at(x, y));
      if (light <= dark) continue;
      const float value = scale * static_cast<float>(pattern.at(x, y)) / light;
      quotient.at(x, y) = static_cast<std::uint16_t>(std::min(value, 65535.F));
    }
  }
  return quotient;
}

template <class T>
std::string size_text(const ImageView<T>& image) {
  return std::to_string(image.width) + "x" + std::to_string(image.height);
}

}  // namespace

Result<Grey16> divide_light(const GreyView& pattern, const GreyView& white) {
  return std::visit(
      [](const auto& lit, const auto& light) -> Result<Grey16> {
        if (lit.width != light.width || lit.height != light.height) {
          return fail(ErrorCode::kMismatch, "the pattern's image has " + size_text(lit) + " pixels, the white one " +
                                                size_text(light) + "; both have to come from one camera in one mode");
        }
        return divide(lit, light);
      },
      pattern, white);
}

}  // namespace slsd
