// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/image.hpp"

namespace slsd::test {

/// Samples row by row, 8 or 16 bits each (PNG: also 1, 2 or 4), channels red, green, blue (, alpha) side by side.
struct Samples {
  int width = 0;
  int height = 0;
  int channels = 1;
  int bits = 8;
  std::vector<std::uint16_t> values;
};

[[nodiscard]] Samples samples_of(const Grey8& image);
[[nodiscard]] Samples samples_of(const Grey16& image);
[[nodiscard]] Samples samples_of(const ColourImage& image);

/// Image files written here from their formats' descriptions alone, the simplest kind of each.
[[nodiscard]] std::string pnm_bytes(const Samples& samples);
[[nodiscard]] std::string plain_pnm_bytes(const Samples& samples);
[[nodiscard]] std::string png_bytes(const Samples& samples, bool interlaced = false);
[[nodiscard]] std::string palette_png_bytes(const Grey8& indices, const std::vector<Rgb>& palette);
[[nodiscard]] std::string tiff_bytes(const Samples& samples, bool big_endian, int rows_per_strip = 3);

/// A picture in which every pixel differs from its neighbours.
[[nodiscard]] Grey8 ramp8(int width, int height, int start = 0);
[[nodiscard]] Grey16 ramp16(int width, int height, int start = 0);

}  // namespace slsd::test
