// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
// Windows bitmap: 14 bytes of file header, an information header that begins with its own length, palette, rows.
#include <array>
#include <bit>
#include <cstdlib>
#include <optional>
#include <utility>
#include <vector>

#include "drivers/files/byte_reader.hpp"
#include "drivers/files/image_formats.hpp"

namespace slsd {
namespace {

constexpr std::uint32_t kUncompressed = 0;
constexpr std::uint32_t kFileHeaderBytes = 14;

using Palette = std::array<std::array<std::uint8_t, 3>, 256>;

struct Header {
  ImageLayout layout;  ///< the stored layout: one channel is an index
  bool top_down = false;
  std::uint32_t pixels_at = 0;
  std::uint32_t palette_at = 0;
  std::uint32_t palette_colours = 0;

  /// The bytes of a row, padded to a multiple of four.
  [[nodiscard]] std::uint64_t row_bytes() const { return (layout.row_samples() + 3) / 4 * 4; }
};

Result<Header> read_header(std::string_view bytes) {
  const ByteReader file(bytes, std::endian::little);
  const auto pixels_at = file.u32(10), information_bytes = file.u32(14), width = file.u32(18), height = file.u32(22);
  const auto bits = file.u16(28), compression = file.u32(30), colours = file.u32(46);
  if (!colours) return fail_truncated("BMP");
  if (*information_bytes < 40 || *information_bytes > 124) return fail_variant("BMP", "an old or unknown header");
  if (*compression != kUncompressed || (bits != 8u && bits != 24u && bits != 32u))
    return fail_variant("BMP", "compression or other than 8, 24 or 32 bits");
  const auto columns = static_cast<std::int32_t>(*width), rows = static_cast<std::int32_t>(*height);
  if (columns <= 0 || *colours > 256) return fail_truncated("BMP");
  Header header;
  header.layout = {*width, static_cast<std::uint64_t>(std::abs(std::int64_t{rows})), static_cast<int>(*bits) / 8, 1};
  header.top_down = rows < 0;
  header.pixels_at = *pixels_at;
  header.palette_at = kFileHeaderBytes + *information_bytes;
  header.palette_colours = bits == 8u ? (*colours == 0 ? 256 : *colours) : 0;
  return header;
}

bool is_whole(const Header& header, std::size_t file_bytes) {
  const std::uint64_t rows_bytes = header.row_bytes() * header.layout.height_px;
  return header.pixels_at >= header.palette_at + 4 * header.palette_colours &&
         header.pixels_at + rows_bytes <= file_bytes;
}

Palette read_palette(const Header& header, std::string_view bytes) {
  Palette palette{};
  for (std::uint32_t i = 0; i < header.palette_colours; ++i)
    for (std::uint32_t c = 0; c < 3; ++c)
      palette[i][c] = static_cast<std::uint8_t>(bytes[header.palette_at + 4 * i + 2 - c]);
  return palette;
}

bool has_colour(const Palette& palette) {
  for (const auto& [red, green, blue] : palette)
    if (red != green || green != blue) return true;
  return false;
}

/// Converts a row of indices into red, green and blue; or reads blue, green, red (and an unused byte).
void read_row(const char* row, int channels, const Palette& palette, std::vector<std::uint8_t>& samples) {
  for (std::size_t x = 0; 3 * x < samples.size(); ++x, row += channels)
    for (std::size_t c = 0; c < 3; ++c)
      samples[3 * x + c] = channels == 1 ? palette[static_cast<std::uint8_t>(*row)][c]
                                         : static_cast<std::uint8_t>(row[2 - static_cast<std::ptrdiff_t>(c)]);
}

}  // namespace

Result<DecodedImage> decode_bmp(std::string_view bytes, std::size_t limit_bytes) {
  const auto header = read_header(bytes);
  if (!header) return tl::unexpected(header.error());
  const ImageLayout& layout = header->layout;
  auto checked = check_layout("BMP", layout, bytes.size(), 1.0, limit_bytes);
  if (!checked) return tl::unexpected(std::move(checked.error()));
  if (!is_whole(*header, bytes.size())) return fail_truncated("BMP");
  const Palette palette = read_palette(*header, bytes);
  Grey8 grey(static_cast<int>(layout.width_px), static_cast<int>(layout.height_px));
  std::vector<std::uint8_t> samples(3 * layout.width_px);
  for (int i = 0; i < grey.height(); ++i) {
    const int y = header->top_down ? i : grey.height() - 1 - i;
    read_row(bytes.data() + header->pixels_at + i * header->row_bytes(), layout.channels, palette, samples);
    grey_row(samples.data(), 3, grey.row(y), grey.width());
  }
  return DecodedImage{std::move(grey), layout.channels > 1 || has_colour(palette)};
}

}  // namespace slsd
