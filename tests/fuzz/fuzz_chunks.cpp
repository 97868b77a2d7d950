// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "drivers/camera/aravis/frames/frame_chunks.hpp"

// The first byte is how many bytes the image has, the rest is the frame. What is taken holds the image and its tag.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size == 0) return 0;
  const std::size_t image_bytes = bytes[0];
  const std::span frame(bytes + 1, size - 1);
  for (const std::endian order : {std::endian::big, std::endian::little})
    if (slsd::is_image_with_chunks(frame, image_bytes, order) && frame.size() < image_bytes + 8) std::abort();
  return 0;
}
