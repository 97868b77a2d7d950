// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
// Portable Network Graphics, second edition (ISO/IEC 15948): signature, then chunks of length, type, contents, CRC.
#include <array>
#include <bit>
#include <optional>

#include "drivers/files/byte_reader.hpp"
#include "drivers/files/image_header.hpp"

namespace slsd {
namespace {

constexpr std::uint64_t kFirstChunk = 8;
constexpr std::uint64_t kChunkFrame = 12;  // length, type and CRC around the contents
constexpr std::uint64_t kDeflateRatioMax = 1032;

constexpr std::uint32_t chunk_type(const char (&name)[5]) {
  return static_cast<std::uint32_t>(name[0]) << 24 | static_cast<std::uint32_t>(name[1]) << 16 |
         static_cast<std::uint32_t>(name[2]) << 8 | static_cast<std::uint32_t>(name[3]);
}

/// The CRC's remainder of each byte, lowest bit first.
constexpr std::array<std::uint32_t, 256> make_crc_table() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t crc = i;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1) != 0 ? 0xedb88320u ^ crc >> 1 : crc >> 1;
    table[i] = crc;
  }
  return table;
}

constexpr std::array<std::uint32_t, 256> kCrcTable = make_crc_table();

std::uint32_t crc_of(std::string_view bytes) {
  std::uint32_t crc = 0xffffffffu;
  for (const char c : bytes) crc = kCrcTable[(crc ^ static_cast<unsigned char>(c)) & 0xff] ^ crc >> 8;
  return ~crc;
}

/// Bytes of compressed pixels, or nothing if the chunks are not sound or do not lead to the end mark. libpng checks the
/// CRC too, but tells standard error of it.
std::optional<std::uint64_t> pixel_bytes(std::string_view bytes) {
  const ByteReader file(bytes, std::endian::big);
  std::uint64_t total = 0;
  for (std::uint64_t at = kFirstChunk;;) {
    const auto length = file.u32(at);
    const auto type = file.u32(at + 4);
    if (!length || !type || file.size() - at < kChunkFrame || *length > file.size() - at - kChunkFrame)
      return std::nullopt;
    if (file.u32(at + 8 + *length) != crc_of(bytes.substr(at + 4, 4 + *length))) return std::nullopt;
    if (*type == chunk_type("IEND")) return total;
    if (*type == chunk_type("IDAT")) total += *length;
    at += kChunkFrame + *length;
  }
}

int stored_channels(std::uint32_t colour_type) {
  switch (colour_type) {
    case 2:
      return 3;
    case 4:
      return 2;
    case 6:
      return 4;
    default:
      return 1;
  }
}

}  // namespace

Result<ImageHeader> read_png_header(std::string_view bytes) {
  const ByteReader file(bytes, std::endian::big);
  const auto width = file.u32(16), height = file.u32(20), depth = file.u8(24), colour_type = file.u8(25);
  const auto compressed = pixel_bytes(bytes);
  if (file.u32(8) != 13u || file.u32(12) != chunk_type("IHDR") || !colour_type || !compressed || *width == 0 ||
      *height == 0)
    return fail_truncated("PNG");
  // What deflate cannot have made of so few bytes is not there; this also keeps a small file from claiming much memory.
  const std::uint64_t row_bits = std::uint64_t{*width} * *depth * stored_channels(*colour_type);
  if (static_cast<double>(row_bits) / 8 * *height > static_cast<double>(*compressed * kDeflateRatioMax))
    return fail_truncated("PNG");
  const int channels = *colour_type == 0 ? 1 : (*colour_type == 2 || *colour_type == 3) ? 3 : 4;
  return ImageHeader{*width, *height, channels, *depth == 16 ? 2 : 1};
}

}  // namespace slsd
