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

void Mask::keep(int left, int top, int right, int bottom) {
  const int words = words_across(width_);
  for (int y = 0; y < height_; ++y) {
    const bool inside = y >= top && y < bottom && left < right;
    for (int word = 0; word < words; ++word) {
      const int first = std::clamp(left - word * kWordPx, 0, kWordPx);
      const int last = std::clamp(right - word * kWordPx, 0, kWordPx);
      if (!inside || first >= last) {
        row(y)[word] = 0;
      } else {
        row(y)[word] &= (~std::uint64_t{0} >> (kWordPx - (last - first))) << first;
      }
    }
  }
}

}  // namespace slsd
