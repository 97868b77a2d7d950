// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/files/encode_png.hpp"

#include <png.h>

#include <bit>
#include <cmath>
#include <csetjmp>
#include <exception>
#include <type_traits>
#include <variant>

namespace slsd {
namespace {

// Frames are noisy: higher levels take many times longer to save a few percent.
constexpr int kCompressionLevel = 1;

struct Rows {
  const void* first = nullptr;
  std::size_t row_bytes = 0;
  int width = 0;
  int height = 0;
  int bits = 8;
  int colour_type = PNG_COLOR_TYPE_GRAY;
  double dpi = 0;  ///< 0: unknown
};

/// libpng reports errors with longjmp(): the function that calls setjmp() must hold no objects with destructors.
class PngWriter {
 public:
  PngWriter()
      : png_(::png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, on_error, on_warning)),
        info_(png_ == nullptr ? nullptr : ::png_create_info_struct(png_)) {}
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;
  ~PngWriter() { ::png_destroy_write_struct(&png_, &info_); }

  bool write(const Rows& rows) {
    if (info_ == nullptr || setjmp(png_jmpbuf(png_)) != 0) return false;
    ::png_set_write_fn(png_, this, on_write, nullptr);
    ::png_set_compression_level(png_, kCompressionLevel);
    ::png_set_filter(png_, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
    ::png_set_IHDR(png_, info_, static_cast<png_uint_32>(rows.width), static_cast<png_uint_32>(rows.height), rows.bits,
                   rows.colour_type, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    if (rows.dpi > 0) {
      const auto per_metre = static_cast<png_uint_32>(std::lround(rows.dpi / 0.0254));
      ::png_set_pHYs(png_, info_, per_metre, per_metre, PNG_RESOLUTION_METER);
    }
    ::png_write_info(png_, info_);
    if (rows.bits == 16 && std::endian::native == std::endian::little) ::png_set_swap(png_);
    for (int y = 0; y < rows.height; ++y)
      ::png_write_row(png_, static_cast<png_const_bytep>(rows.first) + y * rows.row_bytes);
    ::png_write_end(png_, nullptr);
    return true;
  }

  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  [[noreturn]] static void on_error(png_structp png, png_const_charp) { ::png_longjmp(png, 1); }
  static void on_warning(png_structp, png_const_charp) {}

  static void on_write(png_structp png, png_bytep bytes, std::size_t count) {
    auto* self = static_cast<PngWriter*>(::png_get_io_ptr(png));
    bool kept = true;
    try {
      self->bytes_.append(reinterpret_cast<const char*>(bytes), count);
    } catch (const std::exception&) {
      kept = false;
    }
    if (!kept) ::png_error(png, "no memory");
  }

  std::string bytes_;
  png_structp png_;
  png_infop info_;
};

Result<std::string> encode(const Rows& rows) {
  if (rows.width <= 0 || rows.height <= 0)
    return fail(ErrorCode::kInvalidArgument, "an image without pixels cannot become a PNG");
  PngWriter writer;
  if (!writer.write(rows)) return fail(ErrorCode::kIo, "cannot encode the image as PNG; free some memory");
  return writer.bytes();
}

template <class T>
Result<std::string> encode_grey(const ImageView<T>& image) {
  return encode({image.pixels, static_cast<std::size_t>(image.stride) * sizeof(T), image.width, image.height,
                 8 * static_cast<int>(sizeof(T)), PNG_COLOR_TYPE_GRAY});
}

}  // namespace

Result<std::string> encode_png(const Grey8& image) {
  return encode_grey(image.view());
}
Result<std::string> encode_png(const Grey8& image, double dpi) {
  return encode({image.data(), static_cast<std::size_t>(image.width()), image.width(), image.height(), 8,
                 PNG_COLOR_TYPE_GRAY, dpi});
}
Result<std::string> encode_png(const Grey16& image) {
  return encode_grey(image.view());
}

Result<std::string> encode_png(const GreyView& image) {
  return std::visit([](const auto& pixels) { return encode_grey(pixels); }, image);
}

Result<std::string> encode_png(const ColourImage& image) {
  static_assert(sizeof(Rgb) == 3);
  return encode({image.data(), sizeof(Rgb) * static_cast<std::size_t>(image.width()), image.width(), image.height(), 8,
                 PNG_COLOR_TYPE_RGB});
}

}  // namespace slsd
