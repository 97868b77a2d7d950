// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/image.hpp"

namespace slsd::test {

/// Bytes of a row without padding; 0 for MJPG.
[[nodiscard]] int row_bytes_of(std::uint32_t fourcc, int width);

/// The longest frame of a format. @param padding_bytes  after each row
[[nodiscard]] std::size_t frame_bytes_of(std::uint32_t fourcc, int width, int height, int padding_bytes);

/// Writes a grey image in a pixel format, and says how many bytes that are. Mosaics hold the grey as it is; 10, 12 and
/// 16 bits hold it in their high bits; chroma is neutral.
std::size_t encode_frame(const Grey8& image, std::uint32_t fourcc, int padding_bytes, std::vector<std::byte>& bytes);

}  // namespace slsd::test
