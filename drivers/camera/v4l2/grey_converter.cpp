// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/v4l2/grey_converter.hpp"

#include <libv4lconvert.h>
#include <linux/videodev2.h>

#include <variant>

#include "drivers/files/bayer.hpp"
#include "drivers/files/image_formats.hpp"

namespace slsd {
namespace {

template <class T>
ImageView<T> view_as(std::span<const std::byte> bytes, const FrameLayout& layout) {
  return {reinterpret_cast<const T*>(bytes.data()), layout.mode.width_px, layout.mode.height_px,
          static_cast<std::ptrdiff_t>(layout.stride_bytes / sizeof(T))};
}

v4l2_format format_of(const FrameMode& mode, std::uint32_t fourcc) {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  format.fmt.pix.width = static_cast<__u32>(mode.width_px);
  format.fmt.pix.height = static_cast<__u32>(mode.height_px);
  format.fmt.pix.pixelformat = fourcc;
  v4lconvert_fixup_fmt(&format);
  return format;
}

// Devices pad what follows the end marker with zeros.
bool ends_whole(std::span<const std::byte> jpeg) {
  std::size_t end = jpeg.size();
  while (end > 0 && jpeg[end - 1] == std::byte{0}) --end;
  return end >= 4 && jpeg[end - 1] == std::byte{0xd9} && jpeg[end - 2] == std::byte{0xff};
}

GreyImage make_grey(const FrameMode& mode) {
  if (mode.format.layout == GreyLayout::kMosaic16) return Grey16(mode.width_px, mode.height_px);
  return Grey8(mode.width_px, mode.height_px);
}

}  // namespace

void GreyConverter::Destroy::operator()(v4lconvert_data* convert) const {
  v4lconvert_destroy(convert);
}

GreyConverter::GreyConverter(const V4l2Device& device, const FrameLayout& layout)
    : layout_(layout), grey_(make_grey(layout.mode)), columns_(static_cast<std::size_t>(layout.mode.width_px)) {
  if (layout.mode.format.layout != GreyLayout::kJpeg) return;
  colours_.resize(format_of(layout.mode, V4L2_PIX_FMT_RGB24).fmt.pix.sizeimage);
  convert_.reset(v4lconvert_create(device.descriptor()));
}

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

// By way of colour: libv4lconvert makes YUV 4:2:0 only of heights that 16 divides, which 1080 is not.
Result<GreyView> GreyConverter::convert_jpeg(std::span<std::byte> bytes) {
  if (!ends_whole(bytes)) return fail(ErrorCode::kFrameTorn, "a JPEG image was cut short; scan again");
  const v4l2_format from = format_of(layout_.mode, layout_.mode.format.fourcc);
  const v4l2_format to = format_of(layout_.mode, V4L2_PIX_FMT_RGB24);
  const int made =
      convert_ == nullptr
          ? -1
          : v4lconvert_convert(convert_.get(), &from, &to, reinterpret_cast<unsigned char*>(bytes.data()),
                               static_cast<int>(bytes.size()), colours_.data(), static_cast<int>(colours_.size()));
  if (made != static_cast<int>(colours_.size())) {
    return fail(ErrorCode::kFrameTorn, "a JPEG image is damaged; scan again, or choose another format");
  }
  auto& grey = std::get<Grey8>(grey_);
  for (int y = 0; y < grey.height(); ++y)
    grey_row(colours_.data() + std::size_t{3} * y * grey.width(), 3, grey.row(y), grey.width());
  return view(grey_);
}

GreyView view_of(std::span<const std::byte> bytes, const FrameLayout& layout) {
  if (layout.mode.format.layout == GreyLayout::kGrey8) return view_as<std::uint8_t>(bytes, layout);
  return view_as<std::uint16_t>(bytes, layout);
}

}  // namespace slsd
