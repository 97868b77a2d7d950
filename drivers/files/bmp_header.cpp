// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
// Windows bitmap: 14 bytes of file header, an information header that begins with its own length, palette, rows.
#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>
#include <optional>

#include "drivers/files/byte_reader.hpp"
#include "drivers/files/image_header.hpp"

namespace slsd {
namespace {

constexpr std::uint32_t kUncompressed = 0;
constexpr std::array<std::uint32_t, 6> kInformationLengths{40, 52, 56, 64, 108, 124};

/// Bytes of the rows, each filled up to four bytes.
double pixel_bytes(double width_px, double height_px, std::uint32_t bits) {
  const auto row_bits = static_cast<std::uint64_t>(width_px) * bits;
  return static_cast<double>((row_bits + 31) / 32 * 4) * height_px;
}

}  // namespace

Result<ImageHeader> read_bmp_header(std::string_view bytes) {
  const ByteReader file(bytes, std::endian::little);
  const auto pixels_at = file.u32(10), information_length = file.u32(14), width = file.u32(18), height = file.u32(22);
  const auto bits = file.u16(28), compression = file.u32(30), palette = file.u32(46);
  if (!palette) return fail_truncated("BMP");
  if (std::find(kInformationLengths.begin(), kInformationLengths.end(), *information_length) ==
      kInformationLengths.end())
    return fail_variant("BMP", "an old or unknown header");
  if (*compression != kUncompressed || (bits != 8u && bits != 24u && bits != 32u))
    return fail_variant("BMP", "compression or other than 8, 24 or 32 bits");
  // A negative height says that the rows go from top to bottom.
  const std::int64_t rows = std::abs(static_cast<std::int64_t>(static_cast<std::int32_t>(*height)));
  const auto columns = static_cast<std::int32_t>(*width);
  if (columns <= 0 || rows == 0 || *palette > 256) return fail_truncated("BMP");
  const double pixels = pixel_bytes(columns, static_cast<double>(rows), *bits);
  const std::uint32_t palette_bytes = bits == 8u ? 4 * (*palette == 0 ? 256 : *palette) : 0;
  if (*pixels_at < 14 + *information_length + palette_bytes || static_cast<double>(file.size()) - *pixels_at < pixels)
    return fail_truncated("BMP");
  return ImageHeader{static_cast<std::uint64_t>(columns), static_cast<std::uint64_t>(rows), *bits == 32 ? 4 : 3, 1};
}

}  // namespace slsd
