// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/v4l2/frame_layout.hpp"

#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <tuple>

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

constexpr unsigned kListedMax = 1000;  // a device that never ends its list is broken

bool lies_within(const v4l2_frmsize_stepwise& range, int width_px, int height_px) {
  const auto on_step = [](std::int64_t value, std::int64_t low, std::int64_t high, std::int64_t step) {
    return value >= low && value <= high && (step < 2 || (value - low) % step == 0);
  };
  return on_step(width_px, range.min_width, range.max_width, range.step_width) &&
         on_step(height_px, range.min_height, range.max_height, range.step_height);
}

void add_range(const v4l2_frmsize_stepwise& range, const PixelFormat& format, const V4l2CameraOptions& options,
               std::vector<FrameMode>& modes) {
  modes.push_back({format, static_cast<int>(range.min_width), static_cast<int>(range.min_height)});
  modes.push_back({format, static_cast<int>(range.max_width), static_cast<int>(range.max_height)});
  if (options.size_px && lies_within(range, options.size_px->first, options.size_px->second))
    modes.push_back({format, options.size_px->first, options.size_px->second});
}

// If a driver cannot list its sizes, try the wanted size, or else its current one.
void add_tried(const V4l2Device& device, const PixelFormat& format, const V4l2CameraOptions& options,
               std::vector<FrameMode>& modes) {
  v4l2_format tried{};
  tried.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (device.call(VIDIOC_G_FMT, &tried) != 0) return;
  tried.fmt.pix.pixelformat = format.fourcc;
  if (options.size_px) {
    tried.fmt.pix.width = static_cast<__u32>(options.size_px->first);
    tried.fmt.pix.height = static_cast<__u32>(options.size_px->second);
  }
  if (device.call(VIDIOC_TRY_FMT, &tried) != 0 || tried.fmt.pix.pixelformat != format.fourcc) return;
  modes.push_back({format, static_cast<int>(tried.fmt.pix.width), static_cast<int>(tried.fmt.pix.height)});
}

void add_sizes(const V4l2Device& device, const PixelFormat& format, const V4l2CameraOptions& options,
               std::vector<FrameMode>& modes) {
  for (unsigned i = 0; i < kListedMax; ++i) {
    v4l2_frmsizeenum size{};
    size.index = i;
    size.pixel_format = format.fourcc;
    if (device.call(VIDIOC_ENUM_FRAMESIZES, &size) != 0) {
      if (i == 0) add_tried(device, format, options, modes);
      return;
    }
    if (size.type != V4L2_FRMSIZE_TYPE_DISCRETE) return add_range(size.stepwise, format, options, modes);
    modes.push_back({format, static_cast<int>(size.discrete.width), static_cast<int>(size.discrete.height)});
  }
}

std::string list_text(const std::vector<FrameMode>& modes) {
  std::string text;
  for (const FrameMode& mode : modes) (text += text.empty() ? "" : ", ") += to_string(mode);
  return text.empty() ? "nothing that slsd can decode" : text;
}

// Smaller is better.
auto rank(const FrameMode& mode) {
  const auto formats = pixel_formats();
  const auto place = std::find(formats.begin(), formats.end(), mode.format) - formats.begin();
  return std::tuple(place, -static_cast<std::int64_t>(mode.width_px) * mode.height_px);
}

bool fits(const FrameMode& mode, const V4l2CameraOptions& options) {
  if (!options.format.empty() && mode.format.fourcc != fourcc_from(options.format)) return false;
  return !options.size_px || *options.size_px == std::pair(mode.width_px, mode.height_px);
}

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

bool has_chroma_planes(std::uint32_t fourcc) {
  return fourcc == V4L2_PIX_FMT_NV12 || fourcc == V4L2_PIX_FMT_YUV420;
}

ChromaPlanes::ChromaPlanes(const FrameLayout& layout) {
  const auto columns = static_cast<std::size_t>(layout.mode.width_px + 1) / 2;
  const auto rows = static_cast<std::size_t>(layout.mode.height_px + 1) / 2;
  const bool pairs = layout.mode.format.fourcc == V4L2_PIX_FMT_NV12;
  blue = layout.stride_bytes * static_cast<std::size_t>(layout.mode.height_px);
  step_bytes = pairs ? 2 : 1;
  stride_bytes = pairs ? layout.stride_bytes : layout.stride_bytes / 2;  // V4L2 halves the padding of a plane, too
  red = pairs ? blue + 1 : blue + stride_bytes * rows;
  end = red + stride_bytes * (rows - 1) + step_bytes * (columns - 1) + 1;
}

int bytes_per_pixel(GreyLayout layout) {
  return layout == GreyLayout::kGrey16 || layout == GreyLayout::kMosaic16 ? 2 : 1;
}

bool is_zero_copy(GreyLayout layout) {
  return layout == GreyLayout::kGrey8 || layout == GreyLayout::kGrey16;
}

std::string to_string(const FrameMode& mode) {
  return fourcc_name(mode.format.fourcc) + " " + std::to_string(mode.width_px) + "x" + std::to_string(mode.height_px);
}

std::vector<FrameMode> list_modes(const V4l2Device& device, const V4l2CameraOptions& options) {
  std::vector<FrameMode> modes;
  for (unsigned i = 0; i < kListedMax; ++i) {
    v4l2_fmtdesc description{};
    description.index = i;
    description.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (device.call(VIDIOC_ENUM_FMT, &description) != 0) break;
    if (const auto format = find_pixel_format(description.pixelformat)) add_sizes(device, *format, options, modes);
  }
  return modes;
}

Result<FrameMode> choose_mode(const std::vector<FrameMode>& modes, const V4l2CameraOptions& options) {
  const FrameMode* best = nullptr;
  for (const FrameMode& mode : modes) {
    if (fits(mode, options) && (best == nullptr || rank(mode) < rank(*best))) best = &mode;
  }
  if (best != nullptr) return *best;
  return fail(ErrorCode::kUnsupported,
              "the camera does not offer this format and size; it offers: " + list_text(modes) +
                  "; choose format, width_px and height_px from these",
              options.device.string());
}

Result<FrameLayout> set_mode(const V4l2Device& device, const FrameMode& mode) {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  format.fmt.pix.width = static_cast<__u32>(mode.width_px);
  format.fmt.pix.height = static_cast<__u32>(mode.height_px);
  format.fmt.pix.pixelformat = mode.format.fourcc;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  if (const int error = device.call(VIDIOC_S_FMT, &format))
    return device.fail_call(error, "cannot set the format " + to_string(mode));
  const v4l2_pix_format& made = format.fmt.pix;
  const FrameMode got{
      {made.pixelformat, mode.format.layout}, static_cast<int>(made.width), static_cast<int>(made.height)};
  const bool progressive = made.field == V4L2_FIELD_NONE || made.field == V4L2_FIELD_ANY;
  if (got != mode || !progressive) {
    return fail(ErrorCode::kMismatch,
                "asked for " + to_string(mode) + ", the camera set " + to_string(got) +
                    (progressive ? "" : " interlaced") + "; choose another format or size",
                device.path());
  }
  const std::size_t row = row_bytes(mode.format.layout, mode.width_px);
  const std::size_t stride = std::max<std::size_t>(row, made.bytesperline);
  const std::size_t bytes = row == 0 ? 1 : stride * static_cast<std::size_t>(mode.height_px - 1) + row;
  return FrameLayout{mode, stride, bytes};
}

}  // namespace slsd
