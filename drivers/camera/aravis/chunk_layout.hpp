// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

namespace slsd {

/// Whether a frame is one image with chunks behind it and nothing else, as GigE Vision and USB3 Vision lay them out:
/// each is followed by what tells its end only, and so they are read from the last to the first, which is the image.
///
///     | image | id length | chunk | id length | chunk | id length |      id and length: 4 bytes each
///
/// A frame that ends too early, or whose end was written over, has another layout: unless what then stands at its end
/// happens to be a length that leads to another, as the id of a chunk cannot be, which is above any length.
/// @param frame        all that came
/// @param image_bytes  how many the image has; up to 3 more fill up its last word
/// @param order        of the bytes in an id or length: big on GigE Vision, little on USB3 Vision
/// @thread reentrant
[[nodiscard]] bool is_image_with_chunks(std::span<const std::uint8_t> frame, std::size_t image_bytes,
                                        std::endian order);

}  // namespace slsd
