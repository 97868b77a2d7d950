// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "core/image.hpp"
#include "core/regions/mask.hpp"

namespace slsd {

/// A mask as an image: 255 where lit, 0 elsewhere.
inline Grey8 grey_of(const Mask& mask) {
  Grey8 image(mask.width(), mask.height());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) image.at(x, y) = mask.at(x, y) ? 255 : 0;
  }
  return image;
}

/// A mask from a picture: 255 where it shows '#', 0 elsewhere.
inline Grey8 ascii_mask(const std::vector<std::string>& rows) {
  Grey8 mask(static_cast<int>(rows[0].size()), static_cast<int>(rows.size()));
  for (int y = 0; y < mask.height(); ++y) {
    for (int x = 0; x < mask.width(); ++x) mask.at(x, y) = rows[y][x] == '#' ? 255 : 0;
  }
  return mask;
}

/// The same picture as a camera of more bits takes it, from 0 to full; where full is no multiple of 255, rounded.
inline Grey16 deep(const Grey8& image, double full) {
  Grey16 wide(image.width(), image.height());
  for (std::size_t i = 0; i < image.size(); ++i)
    wide.data()[i] = static_cast<std::uint16_t>(std::lround(image.data()[i] * full / 255));
  return wide;
}

inline Grey16 sixteen_bits(const Grey8& image) {
  return deep(image, 65535);
}

}  // namespace slsd
