// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "core/image.hpp"

namespace slsd {

/// The lit pixels of a frame, one bit each, so that the mask stays in the cache between stages.
/// @thread reentrant
class Mask {
 public:
  static constexpr int kWordPx = 64;

  Mask() = default;
  /// All dark.
  Mask(int width, int height)
      : words_(static_cast<std::size_t>(words_across(width)) * height), width_(width), height_(height) {}
  /// Resizes the mask and makes it all dark; reuses its memory.
  void clear(int width, int height) {
    words_.assign(static_cast<std::size_t>(words_across(width)) * height, 0);
    width_ = width, height_ = height;
  }
  void light(int x, int y) { row(y)[x / kWordPx] |= std::uint64_t{1} << (x % kWordPx); }
  /// @param image  255 where lit, 0 elsewhere
  explicit Mask(const ImageView<std::uint8_t>& image);
  /// Makes all pixels dark outside a rectangle within the mask; right and bottom are one past the last.
  void keep(int left, int top, int right, int bottom);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] bool at(int x, int y) const { return (row(y)[x / kWordPx] >> (x % kWordPx) & 1U) != 0; }
  /// The first pixel is the lowest bit of the first word; bits beyond the last pixel are dark.
  [[nodiscard]] std::uint64_t* row(int y) {
    return words_.data() + static_cast<std::ptrdiff_t>(y) * words_across(width_);
  }
  [[nodiscard]] const std::uint64_t* row(int y) const {
    return words_.data() + static_cast<std::ptrdiff_t>(y) * words_across(width_);
  }
  friend bool operator==(const Mask&, const Mask&) = default;

 private:
  [[nodiscard]] static int words_across(int width) { return (width + kWordPx - 1) / kWordPx; }

  std::vector<std::uint64_t> words_;
  int width_ = 0, height_ = 0;
};

/// The top bits of as many bytes as a mask word has pixels, the first byte in the lowest bit.
static inline __attribute__((always_inline)) std::uint64_t top_bits(const std::uint8_t* bytes) {
  std::uint64_t bits = 0;
#ifdef __SSE2__
  constexpr int kAtOnce = 16;
  for (int i = 0; i < Mask::kWordPx; i += kAtOnce) {
    const auto tops = _mm_movemask_epi8(_mm_loadu_si128(reinterpret_cast<const __m128i*>(bytes + i)));
    bits |= static_cast<std::uint64_t>(static_cast<std::uint32_t>(tops)) << i;
  }
#else
  // The multiplication gathers the top bits of eight bytes; the first byte in memory is the lowest.
  static_assert(std::endian::native == std::endian::little);
  constexpr int kAtOnce = 8;
  for (int i = 0; i < Mask::kWordPx; i += kAtOnce) {
    std::uint64_t eight = 0;
    std::memcpy(&eight, bytes + i, sizeof eight);
    bits |= ((eight & 0x8080808080808080U) * 0x0002040810204081U >> 56U) << i;
  }
#endif
  return bits;
}

}  // namespace slsd
