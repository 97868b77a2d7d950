// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/chunk_layout.hpp"

namespace slsd {
namespace {

constexpr std::size_t kLengthBytes = 4;
constexpr std::size_t kTagBytes = 4 + kLengthBytes;
constexpr std::size_t kWordBytes = 4;

std::size_t length_before(std::span<const std::uint8_t> bytes, std::size_t end, std::endian order) {
  std::size_t length = 0;
  for (std::size_t i = 0; i < kLengthBytes; ++i) {
    const std::size_t at = order == std::endian::big ? end - kLengthBytes + i : end - 1 - i;
    length = length << 8 | bytes[at];
  }
  return length;
}

}  // namespace

bool is_image_with_chunks(std::span<const std::uint8_t> frame, std::size_t image_bytes, std::endian order) {
  for (std::size_t end = frame.size(); end >= image_bytes + kTagBytes;) {
    const std::size_t length = length_before(frame, end, order);
    if (length > end - kTagBytes) return false;
    end -= kTagBytes + length;
    if (end == 0) return length >= image_bytes && length < image_bytes + kWordBytes;
  }
  return false;
}

}  // namespace slsd
