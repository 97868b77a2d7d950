// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
// Tag Image File Format through libtiff: its first image, in strips.
#include <tiffio.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/files/image_formats.hpp"

namespace slsd {
namespace {

// LZW's longest string for its shortest code; deflate compresses less.
constexpr double kCompressionMax = 4096.0 * 8.0 / 9.0;

/// The bytes that libtiff reads as a file. Must outlive the TIFF.
struct Memory {
  std::string_view bytes;
  toff_t at = 0;
};

Memory& memory(thandle_t handle) {
  return *static_cast<Memory*>(handle);
}

tmsize_t read(thandle_t handle, void* to, tmsize_t count) {
  Memory& file = memory(handle);
  const auto rest = file.at < file.bytes.size() ? file.bytes.substr(file.at) : std::string_view();
  const std::size_t available = std::min(rest.size(), static_cast<std::size_t>(count));
  if (available > 0) std::memcpy(to, rest.data(), available);
  file.at += available;
  return static_cast<tmsize_t>(available);
}

tmsize_t write(thandle_t, void*, tmsize_t) {
  return -1;
}

toff_t seek(thandle_t handle, toff_t offset, int whence) {
  Memory& file = memory(handle);
  const toff_t from = whence == SEEK_CUR ? file.at : (whence == SEEK_END ? file.bytes.size() : 0);
  return file.at = from + offset;
}

int close(thandle_t) {
  return 0;
}
toff_t size(thandle_t handle) {
  return memory(handle).bytes.size();
}
int say_nothing(TIFF*, void*, const char*, const char*, va_list) {
  return 1;
}

struct Closer {
  void operator()(TIFF* tiff) const { ::TIFFClose(tiff); }
  void operator()(TIFFOpenOptions* options) const { ::TIFFOpenOptionsFree(options); }
};
using Tiff = std::unique_ptr<TIFF, Closer>;

Tiff open(Memory& file, std::size_t limit_bytes) {
  const std::unique_ptr<TIFFOpenOptions, Closer> options(::TIFFOpenOptionsAlloc());
  if (!options) return nullptr;
  ::TIFFOpenOptionsSetErrorHandlerExtR(options.get(), say_nothing, nullptr);
  ::TIFFOpenOptionsSetWarningHandlerExtR(options.get(), say_nothing, nullptr);
  ::TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), static_cast<tmsize_t>(limit_bytes + file.bytes.size()));
  return Tiff(::TIFFClientOpenExt("", "rm", &file, read, write, seek, close, size, nullptr, nullptr, options.get()));
}

std::uint32_t tag(const Tiff& tiff, std::uint32_t number) {
  std::uint16_t value = 0;
  return ::TIFFGetFieldDefaulted(tiff.get(), number, &value) == 1 ? value : 0;
}

bool one_of(std::uint32_t value, std::initializer_list<std::uint32_t> choices) {
  return std::find(choices.begin(), choices.end(), value) != choices.end();
}

std::optional<std::string> find_rare(const Tiff& tiff) {
  const std::uint32_t samples = tag(tiff, TIFFTAG_SAMPLESPERPIXEL), photometric = tag(tiff, TIFFTAG_PHOTOMETRIC);
  const bool rgb = photometric == PHOTOMETRIC_RGB;
  if (::TIFFIsTiled(tiff.get()) != 0) return "tiles";
  if (!one_of(tag(tiff, TIFFTAG_COMPRESSION), {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE,
                                               COMPRESSION_DEFLATE, COMPRESSION_PACKBITS}))
    return "this compression";
  if (!one_of(photometric, {PHOTOMETRIC_MINISBLACK, PHOTOMETRIC_RGB}))
    return "inverted grey, a palette or rare colours";
  if (!one_of(tag(tiff, TIFFTAG_BITSPERSAMPLE), {8, 16})) return "a bit depth other than 8 or 16";
  if (!one_of(samples, rgb ? std::initializer_list<std::uint32_t>{3, 4} : std::initializer_list<std::uint32_t>{1, 2}))
    return "more channels than colours and alpha";
  if (samples > 1 && tag(tiff, TIFFTAG_PLANARCONFIG) != PLANARCONFIG_CONTIG) return "separate planes";
  if (tag(tiff, TIFFTAG_ORIENTATION) != ORIENTATION_TOPLEFT) return "rotated or mirrored rows";
  if (tag(tiff, TIFFTAG_SAMPLEFORMAT) != SAMPLEFORMAT_UINT) return "signed or floating-point pixels";
  return std::nullopt;
}

ImageLayout layout_of(const Tiff& tiff) {
  std::uint32_t width = 0, height = 0;
  ::TIFFGetField(tiff.get(), TIFFTAG_IMAGEWIDTH, &width);
  ::TIFFGetField(tiff.get(), TIFFTAG_IMAGELENGTH, &height);
  return {width, height, static_cast<int>(tag(tiff, TIFFTAG_SAMPLESPERPIXEL)),
          static_cast<int>(tag(tiff, TIFFTAG_BITSPERSAMPLE)) / 8};
}

template <class T>
Result<DecodedImage> read_as(const Tiff& tiff, const ImageLayout& layout, KeepColours keep) {
  std::vector<T> samples(layout.row_samples());
  if (::TIFFScanlineSize64(tiff.get()) != samples.size() * sizeof(T)) return fail_truncated("TIFF");
  DecodedRows<T> image(layout, keep);
  for (int y = 0; y < image.height(); ++y) {
    if (::TIFFReadScanline(tiff.get(), samples.data(), static_cast<std::uint32_t>(y), 0) != 1)
      return fail_truncated("TIFF");
    image.set_row(y, samples.data());
  }
  return image.take();
}

}  // namespace

Result<DecodedImage> decode_tiff(std::string_view bytes, std::size_t limit_bytes, KeepColours keep) {
  Memory file{bytes};
  const Tiff tiff = open(file, limit_bytes);
  if (!tiff) return fail_truncated("TIFF");
  if (const auto rare = find_rare(tiff)) return fail_variant("TIFF", *rare);
  const ImageLayout layout = layout_of(tiff);
  const bool compressed = tag(tiff, TIFFTAG_COMPRESSION) != COMPRESSION_NONE;
  auto checked = check_layout("TIFF", layout, bytes.size(), compressed ? kCompressionMax : 1.0, limit_bytes);
  if (!checked) return tl::unexpected(std::move(checked.error()));
  if (layout.bytes_per_channel == 2) return read_as<std::uint16_t>(tiff, layout, keep);
  return read_as<std::uint8_t>(tiff, layout, keep);
}

}  // namespace slsd
