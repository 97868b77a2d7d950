// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/v4l2/read_colours.hpp"

#include <linux/videodev2.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "drivers/camera/v4l2/grey_converter.hpp"
#include "drivers/files/bayer.hpp"
#include "drivers/files/jpeg_decoder.hpp"

namespace slsd {
namespace {

using Bytes = std::vector<std::byte>;

BayerPattern pattern_of(std::uint32_t fourcc) {
  switch (fourcc) {
    case V4L2_PIX_FMT_SRGGB8:
    case V4L2_PIX_FMT_SRGGB10:
    case V4L2_PIX_FMT_SRGGB12:
    case V4L2_PIX_FMT_SRGGB16:
      return BayerPattern::kRggb;
    case V4L2_PIX_FMT_SBGGR8:
    case V4L2_PIX_FMT_SBGGR10:
    case V4L2_PIX_FMT_SBGGR12:
    case V4L2_PIX_FMT_SBGGR16:
      return BayerPattern::kBggr;
    case V4L2_PIX_FMT_SGRBG8:
    case V4L2_PIX_FMT_SGRBG10:
    case V4L2_PIX_FMT_SGRBG12:
    case V4L2_PIX_FMT_SGRBG16:
      return BayerPattern::kGrbg;
    default:
      return BayerPattern::kGbrg;
  }
}

ColourLevels rgb_of(std::byte luma, std::byte blue, std::byte red) {
  const double y = 255.0 / 219 * (std::to_integer<int>(luma) - 16), u = std::to_integer<int>(blue) - 128,
               v = std::to_integer<int>(red) - 128;
  const auto level = [](double value) {
    return static_cast<std::uint16_t>(std::lround(std::clamp(value, 0.0, 255.0)));
  };
  return {level(y + 1.596027 * v), level(y - 0.391762 * u - 0.812968 * v), level(y + 2.017232 * u)};
}

/// @param luma  place of the first luma in the four bytes of two pixels
ColourFrame from_chroma(const Bytes& bytes, const FrameLayout& layout, std::size_t luma) {
  ColourFrame colours(layout.mode.width_px, layout.mode.height_px);
  for (int y = 0; y < colours.height(); ++y) {
    const std::byte* const row = bytes.data() + static_cast<std::size_t>(y) * layout.stride_bytes;
    for (int x = 0; x < colours.width(); ++x) {
      const std::byte* const pair = row + 4 * static_cast<std::ptrdiff_t>(x / 2);
      colours.at(x, y) = rgb_of(pair[luma + 2 * (static_cast<std::size_t>(x) % 2)], pair[1 - luma], pair[3 - luma]);
    }
  }
  return colours;
}

/// Rows of luma, then chroma for each square of four pixels: NV12 has rows of pairs, YUV420 a plane of each.
ColourFrame from_planes(const Bytes& bytes, const FrameLayout& layout) {
  ColourFrame colours(layout.mode.width_px, layout.mode.height_px);
  const ChromaPlanes planes(layout);
  for (int y = 0; y < colours.height(); ++y) {
    const std::byte* const luma = bytes.data() + static_cast<std::size_t>(y) * layout.stride_bytes;
    const std::size_t row = static_cast<std::size_t>(y / 2) * planes.stride_bytes;
    for (int x = 0; x < colours.width(); ++x) {
      const std::size_t at = row + static_cast<std::size_t>(x / 2) * planes.step_bytes;
      colours.at(x, y) = rgb_of(luma[x], bytes[planes.blue + at], bytes[planes.red + at]);
    }
  }
  return colours;
}

Result<ColourFrame> from_jpeg(const Bytes& bytes, const FrameLayout& layout) {
  JpegDecoder decoder({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  if (auto header = decoder.read_header(); !header) return tl::unexpected(std::move(header.error()));
  ColourFrame colours(layout.mode.width_px, layout.mode.height_px);
  if (decoder.width_px() != colours.width() || decoder.height_px() != colours.height())
    return fail(ErrorCode::kFrameTorn, "a JPEG image of another size arrived; scan again");
  if (!decoder.colour()) return ColourFrame();
  if (auto read = decoder.read_colours(colours); !read) return tl::unexpected(std::move(read.error()));
  return colours;
}

Result<ColourFrame> convert(const Bytes& bytes, const FrameLayout& layout) {
  switch (layout.mode.format.layout) {
    case GreyLayout::kYuyv:
      return from_chroma(bytes, layout, 0);
    case GreyLayout::kUyvy:
      return from_chroma(bytes, layout, 1);
    case GreyLayout::kJpeg:
      return from_jpeg(bytes, layout);
    case GreyLayout::kGrey8:
      return from_planes(bytes, layout);
    default:
      return colours_from_mosaic(mosaic_view_of(bytes, layout), pattern_of(layout.mode.format.fourcc));
  }
}

}  // namespace

std::function<Result<ColourFrame>()> colours_later(std::span<const std::byte> bytes, const FrameLayout& layout) {
  const GreyLayout kind = layout.mode.format.layout;
  const bool planes = has_chroma_planes(layout.mode.format.fourcc);
  if ((kind == GreyLayout::kGrey8 && !planes) || kind == GreyLayout::kGrey16) return {};
  if (planes && bytes.size() < ChromaPlanes(layout).end) return {};  // the driver gives the luma alone
  return [copy = std::make_shared<const Bytes>(bytes.begin(), bytes.end()), layout] { return convert(*copy, layout); };
}

}  // namespace slsd
