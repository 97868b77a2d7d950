// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/v4l2/grey_converter.hpp"

#include <string>
#include <utility>
#include <variant>

#include "drivers/files/bayer.hpp"
#include "drivers/files/jpeg_decoder.hpp"

namespace slsd {
namespace {

template <class T>
ImageView<T> view_as(std::span<const std::byte> bytes, const FrameLayout& layout) {
  return {reinterpret_cast<const T*>(bytes.data()), layout.mode.width_px, layout.mode.height_px,
          static_cast<std::ptrdiff_t>(layout.stride_bytes / sizeof(T))};
}

std::string size_text(int width_px, int height_px) {
  return std::to_string(width_px) + "x" + std::to_string(height_px);
}

// A fault of one frame need not affect the next.
tl::unexpected<Error> as_torn(Error error) {
  if (error.code == ErrorCode::kMalformed) error = {ErrorCode::kFrameTorn, error.message + "; scan again", {}};
  return tl::unexpected(std::move(error));
}

GreyImage make_grey(const FrameMode& mode) {
  if (mode.format.layout == GreyLayout::kMosaic16) return Grey16(mode.width_px, mode.height_px);
  return Grey8(mode.width_px, mode.height_px);
}

}  // namespace

GreyConverter::GreyConverter(const FrameLayout& layout)
    : layout_(layout), grey_(make_grey(layout.mode)), columns_(static_cast<std::size_t>(layout.mode.width_px)) {}

Result<GreyView> GreyConverter::convert(std::span<std::byte> bytes) {
  switch (layout_.mode.format.layout) {
    case GreyLayout::kYuyv:
      return take_luma(bytes, 0);
    case GreyLayout::kUyvy:
      return take_luma(bytes, 1);
    case GreyLayout::kMosaic8:
      grey_from_mosaic(view_as<std::uint8_t>(bytes, layout_), std::get<Grey8>(grey_), columns_);
      return view(grey_);
    case GreyLayout::kMosaic16:
      grey_from_mosaic(view_as<std::uint16_t>(bytes, layout_), std::get<Grey16>(grey_), columns_);
      return view(grey_);
    case GreyLayout::kJpeg:
      return convert_jpeg(bytes);
    default:
      return view_of(bytes, layout_);
  }
}

GreyView GreyConverter::take_luma(std::span<const std::byte> bytes, std::size_t first) {
  auto& grey = std::get<Grey8>(grey_);
  for (int y = 0; y < grey.height(); ++y) {
    const std::byte* from = bytes.data() + static_cast<std::size_t>(y) * layout_.stride_bytes + first;
    std::uint8_t* to = grey.row(y);
    for (int x = 0; x < grey.width(); ++x) to[x] = static_cast<std::uint8_t>(from[2 * x]);
  }
  return view(grey_);
}

Result<GreyView> GreyConverter::convert_jpeg(std::span<const std::byte> bytes) {
  auto& grey = std::get<Grey8>(grey_);
  JpegDecoder decoder({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  if (auto header = decoder.read_header(); !header) return as_torn(std::move(header.error()));
  if (decoder.width_px() != grey.width() || decoder.height_px() != grey.height()) {
    return fail(ErrorCode::kFrameTorn, "a JPEG image of " + size_text(decoder.width_px(), decoder.height_px()) +
                                           " pixels arrived, but the camera's format is " +
                                           size_text(grey.width(), grey.height()) +
                                           "; choose another size or format if this happens again");
  }
  if (auto read = decoder.read_grey(grey); !read) return as_torn(std::move(read.error()));
  return view(grey_);
}

GreyView mosaic_view_of(std::span<const std::byte> bytes, const FrameLayout& layout) {
  if (layout.mode.format.layout == GreyLayout::kMosaic8) return view_as<std::uint8_t>(bytes, layout);
  return view_as<std::uint16_t>(bytes, layout);
}

GreyView view_of(std::span<const std::byte> bytes, const FrameLayout& layout) {
  if (layout.mode.format.layout == GreyLayout::kGrey8) return view_as<std::uint8_t>(bytes, layout);
  return view_as<std::uint16_t>(bytes, layout);
}

}  // namespace slsd
