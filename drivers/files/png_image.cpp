// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
// Portable Network Graphics through libpng, which checks each chunk's CRC and the number of pixels.
#include <png.h>

#include <bit>
#include <csetjmp>
#include <cstring>
#include <vector>

#include "drivers/files/image_formats.hpp"

namespace slsd {
namespace {

constexpr double kDeflateRatioMax = 1032.0;

/// libpng reports errors with longjmp(): the functions that call setjmp() hold no objects with destructors.
class PngReader {
 public:
  explicit PngReader(std::string_view bytes)
      : rest_(bytes),
        png_(::png_create_read_struct(PNG_LIBPNG_VER_STRING, this, on_error, on_warning)),
        info_(png_ == nullptr ? nullptr : ::png_create_info_struct(png_)) {}
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;
  ~PngReader() { ::png_destroy_read_struct(&png_, &info_, nullptr); }

  /// Reads up to the pixels, and requests samples of 8 or 16 bits without alpha.
  bool read_header() {
    if (info_ == nullptr || setjmp(png_jmpbuf(png_)) != 0) return false;
    ::png_set_read_fn(png_, this, on_read);
    ::png_read_info(png_, info_);
    if (::png_get_color_type(png_, info_) == PNG_COLOR_TYPE_PALETTE) ::png_set_palette_to_rgb(png_);
    if (::png_get_bit_depth(png_, info_) < 8) ::png_set_expand_gray_1_2_4_to_8(png_);
    if (std::endian::native == std::endian::little) ::png_set_swap(png_);
    ::png_set_strip_alpha(png_);
    static_cast<void>(::png_set_interlace_handling(png_));
    ::png_read_update_info(png_, info_);
    return true;
  }

  [[nodiscard]] ImageLayout layout() const {
    return {::png_get_image_width(png_, info_), ::png_get_image_height(png_, info_), ::png_get_channels(png_, info_),
            ::png_get_bit_depth(png_, info_) / 8};
  }

  bool read_pixels(png_bytepp rows) {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    ::png_read_image(png_, rows);
    ::png_read_end(png_, nullptr);
    return true;
  }

 private:
  [[noreturn]] static void on_error(png_structp png, png_const_charp) { ::png_longjmp(png, 1); }
  static void on_warning(png_structp, png_const_charp) {}

  static void on_read(png_structp png, png_bytep to, std::size_t count) {
    auto* self = static_cast<PngReader*>(::png_get_io_ptr(png));
    if (count > self->rest_.size()) ::png_error(png, "ends early");
    std::memcpy(to, self->rest_.data(), count);
    self->rest_.remove_prefix(count);
  }

  std::string_view rest_;
  png_structp png_;
  png_infop info_;
};

template <class T>
Result<DecodedImage> read_as(PngReader& reader, const ImageLayout& layout, KeepColours keep) {
  std::vector<T> samples(layout.row_samples() * layout.height_px);
  std::vector<png_bytep> rows(layout.height_px);
  for (std::size_t y = 0; y < rows.size(); ++y)
    rows[y] = reinterpret_cast<png_bytep>(samples.data() + y * layout.row_samples());
  if (!reader.read_pixels(rows.data())) return fail_truncated("PNG");
  DecodedRows<T> image(layout, keep);
  for (int y = 0; y < image.height(); ++y) image.set_row(y, samples.data() + y * layout.row_samples());
  return image.take();
}

}  // namespace

Result<DecodedImage> decode_png(std::string_view bytes, std::size_t limit_bytes, KeepColours keep) {
  PngReader reader(bytes);
  if (!reader.read_header()) return fail_truncated("PNG");
  const ImageLayout layout = reader.layout();
  // A palette, or one bit per pixel, makes up to 24 samples from one byte.
  auto checked = check_layout("PNG", layout, bytes.size(), 24.0 * kDeflateRatioMax, limit_bytes);
  if (!checked) return tl::unexpected(std::move(checked.error()));
  if (layout.bytes_per_channel == 2) return read_as<std::uint16_t>(reader, layout, keep);
  return read_as<std::uint8_t>(reader, layout, keep);
}

}  // namespace slsd
