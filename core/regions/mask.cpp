// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/regions/mask.hpp"

#include <algorithm>

namespace slsd {

Mask::Mask(const ImageView<std::uint8_t>& image) : Mask(image.width, image.height) {
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; x += kWordPx) {
      std::uint8_t bytes[kWordPx] = {};
      std::copy_n(image.row(y) + x, std::min(kWordPx, image.width - x), bytes);
      row(y)[x / kWordPx] = top_bits(bytes);
    }
  }
}

}  // namespace slsd
