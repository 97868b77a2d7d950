// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/v4l2/pixel_format.hpp"

#include <linux/videodev2.h>

#include <algorithm>
#include <array>

namespace slsd {
namespace {

constexpr std::array kFormats{
    PixelFormat{V4L2_PIX_FMT_GREY, GreyLayout::kGrey8},       PixelFormat{V4L2_PIX_FMT_Y16, GreyLayout::kGrey16},
    PixelFormat{V4L2_PIX_FMT_Y14, GreyLayout::kGrey16},       PixelFormat{V4L2_PIX_FMT_Y12, GreyLayout::kGrey16},
    PixelFormat{V4L2_PIX_FMT_Y10, GreyLayout::kGrey16},       PixelFormat{V4L2_PIX_FMT_SRGGB8, GreyLayout::kMosaic8},
    PixelFormat{V4L2_PIX_FMT_SBGGR8, GreyLayout::kMosaic8},   PixelFormat{V4L2_PIX_FMT_SGRBG8, GreyLayout::kMosaic8},
    PixelFormat{V4L2_PIX_FMT_SGBRG8, GreyLayout::kMosaic8},   PixelFormat{V4L2_PIX_FMT_SRGGB16, GreyLayout::kMosaic16},
    PixelFormat{V4L2_PIX_FMT_SBGGR16, GreyLayout::kMosaic16}, PixelFormat{V4L2_PIX_FMT_SGRBG16, GreyLayout::kMosaic16},
    PixelFormat{V4L2_PIX_FMT_SGBRG16, GreyLayout::kMosaic16}, PixelFormat{V4L2_PIX_FMT_SRGGB12, GreyLayout::kMosaic16},
    PixelFormat{V4L2_PIX_FMT_SBGGR12, GreyLayout::kMosaic16}, PixelFormat{V4L2_PIX_FMT_SGRBG12, GreyLayout::kMosaic16},
    PixelFormat{V4L2_PIX_FMT_SGBRG12, GreyLayout::kMosaic16}, PixelFormat{V4L2_PIX_FMT_SRGGB10, GreyLayout::kMosaic16},
    PixelFormat{V4L2_PIX_FMT_SBGGR10, GreyLayout::kMosaic16}, PixelFormat{V4L2_PIX_FMT_SGRBG10, GreyLayout::kMosaic16},
    PixelFormat{V4L2_PIX_FMT_SGBRG10, GreyLayout::kMosaic16}, PixelFormat{V4L2_PIX_FMT_NV12, GreyLayout::kGrey8},
    PixelFormat{V4L2_PIX_FMT_YUV420, GreyLayout::kGrey8},     PixelFormat{V4L2_PIX_FMT_YUYV, GreyLayout::kYuyv},
    PixelFormat{V4L2_PIX_FMT_UYVY, GreyLayout::kUyvy},        PixelFormat{V4L2_PIX_FMT_MJPEG, GreyLayout::kJpeg},
    PixelFormat{V4L2_PIX_FMT_JPEG, GreyLayout::kJpeg}};

}  // namespace

std::span<const PixelFormat> pixel_formats() {
  return kFormats;
}

std::optional<PixelFormat> find_pixel_format(std::uint32_t fourcc) {
  const auto* found = std::find_if(kFormats.begin(), kFormats.end(),
                                   [&](const PixelFormat& format) { return format.fourcc == fourcc; });
  if (found == kFormats.end()) return std::nullopt;
  return *found;
}

std::uint32_t fourcc_from(std::string_view name) {
  std::uint32_t fourcc = 0;
  for (unsigned i = 0; i < 4; ++i) {
    const char letter = i < name.size() ? name[i] : ' ';
    fourcc |= static_cast<std::uint32_t>(static_cast<unsigned char>(letter)) << (8 * i);
  }
  return fourcc;
}

std::string fourcc_name(std::uint32_t fourcc) {
  std::string name;
  for (unsigned i = 0; i < 4; ++i) {
    const auto letter = static_cast<char>((fourcc >> (8 * i)) & 0x7f);
    name += letter >= ' ' && letter <= '~' ? letter : '?';
  }
  name.erase(name.find_last_not_of(' ') + 1);
  return name;
}

std::size_t row_bytes(GreyLayout layout, int width_px) {
  const auto width = static_cast<std::size_t>(width_px);
  switch (layout) {
    case GreyLayout::kGrey8:
    case GreyLayout::kMosaic8:
      return width;
    case GreyLayout::kJpeg:
      return 0;
    default:
      return 2 * width;
  }
}

int bytes_per_pixel(GreyLayout layout) {
  return layout == GreyLayout::kGrey16 || layout == GreyLayout::kMosaic16 ? 2 : 1;
}

bool is_zero_copy(GreyLayout layout) {
  return layout == GreyLayout::kGrey8 || layout == GreyLayout::kGrey16;
}

}  // namespace slsd
