// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/divide_light.hpp"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "core/exposure/light_levels.hpp"
#include "core/exposure/pixel_noise.hpp"
#include "core/image_size.hpp"

namespace slsd {
namespace {

/// What light is trusted: of the brightest of the white image, and in standard deviations of its noise.
constexpr float kFaintShare = 0.02F, kFaintSigma = 4, kFaintLevels = 2;

std::pair<int, int> size_of(const GreyView& image) {
  return std::visit([](const auto& view) { return std::pair(view.width, view.height); }, image);
}

float full_of(const GreyView& image) {
  return image.index() == 0 ? std::numeric_limits<std::uint8_t>::max() : std::numeric_limits<std::uint16_t>::max();
}

void copy_row(const GreyView& image, int y, float scale, std::vector<float>& row) {
  std::visit(
      [&](const auto& view) {
        row.resize(view.width);
        for (int x = 0; x < view.width; ++x) row[x] = scale * static_cast<float>(view.row(y)[x]);
      },
      image);
}

float brightest(const GreyView& image) {
  return std::visit(
      [](const auto& view) {
        float most = 0;
        for (int y = 0; y < view.height; ++y) {
          if (view.width > 0) most = std::max<float>(most, *std::max_element(view.row(y), view.row(y) + view.width));
        }
        return most;
      },
      image);
}

}  // namespace

Result<Grey16> divide_light(const GreyView& pattern, const GreyView& white, const std::optional<GreyView>& dark) {
  const auto [width, height] = size_of(white);
  for (const auto& [name, other] : {std::pair("pattern's", std::optional(pattern)), std::pair("black", dark)}) {
    if (!other || size_of(*other) == size_of(white)) continue;
    const auto [other_width, other_height] = size_of(*other);
    return fail(ErrorCode::kMismatch, std::string("the ") + name + " image has " +
                                          size_text(other_width, other_height) + " pixels, the white one " +
                                          size_text(width, height) + "; all have to come from one camera in one mode");
  }
  const float faint = std::max(
      {kFaintLevels, kFaintShare * brightest(white), kFaintSigma * pixel_noise(white, guess_full_level(white))});
  // Images of one camera have the same depth; if not, full levels are what they have in common.
  const float white_levels = full_of(white) / full_of(pattern);
  Grey16 quotient(width, height);
  std::vector<float> lit, light, room(width, 0.F);
  for (int y = 0; y < height; ++y) {
    copy_row(pattern, y, white_levels, lit);
    copy_row(white, y, 1, light);
    if (dark) copy_row(*dark, y, full_of(white) / full_of(*dark), room);
    std::uint16_t* const row = quotient.row(y);
    for (int x = 0; x < width; ++x) {
      // As Wiener's filter divides: by no less than what noise may be.
      const float divisor = std::max(0.F, light[x] - room[x]);
      const float share = std::max(0.F, lit[x] - room[x]) * divisor / (divisor * divisor + faint * faint);
      row[x] = static_cast<std::uint16_t>(
          std::min(static_cast<float>(kAsBrightAsWhite) * share, static_cast<float>(kQuotientFull)));
    }
  }
  return quotient;
}

}  // namespace slsd
