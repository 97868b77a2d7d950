// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <vector>

namespace slsd::test {

/// How many bits of a pixel are used in a format of GigE Vision.
[[nodiscard]] int used_bits(std::uint32_t pixel_format);

/// Packs pixels of two bytes as a packed format wants it; leaves the others alone.
void pack_pixels(std::uint32_t pixel_format, std::vector<std::uint8_t>& pixels);

}  // namespace slsd::test
