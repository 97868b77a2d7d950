// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/projected_picture.hpp"

#include <utility>

#include "core/image_size.hpp"
#include "drivers/files/read_image.hpp"
#include "picture/focus_chart.hpp"
#include "picture/view_grid.hpp"

namespace slsd {
namespace {

constexpr std::size_t kMaxDecodedBytes = 64 << 20;  // 3840x2160 in the colours of 48 bits

Result<std::optional<Grey8>> read_picture(std::string_view png, int width_px, int height_px) {
  ReadImageOptions options;
  options.limit_decoded_bytes = kMaxDecodedBytes;
  auto decoded = decode_image(png, "the image", options);
  if (!decoded) return tl::unexpected(decoded.error());
  auto* grey = std::get_if<Grey8>(&*decoded);
  if (grey == nullptr) return fail(ErrorCode::kMismatch, "the image has 16 bits a pixel, a projector 8: convert it");
  if (grey->width() == width_px && grey->height() == height_px) return std::move(*grey);
  return fail(ErrorCode::kMismatch, "the image is " + size_text(grey->width(), grey->height()) +
                                        " pixels, the projector " + size_text(width_px, height_px) +
                                        ": it is shown pixel for pixel, make it of that size");
}

Result<std::optional<Grey8>> draw_grid(const ScanSetup& setup) {
  if (setup.calibration) return draw_view_grid(*setup.calibration, setup.depth_min_mm, setup.depth_max_mm);
  return fail(ErrorCode::kNotFound, "what the cameras see is known once they are calibrated: calibrate first");
}

}  // namespace

Result<std::optional<Grey8>> draw_projected(Picture picture, std::string_view png, const ScanSetup& setup) {
  const int width_px = setup.image.width();
  const int height_px = setup.image.height();
  switch (picture) {
    case Picture::kIdle:
    case Picture::kHeld:
    case Picture::kPattern:
      return std::nullopt;
    case Picture::kBlack:
      return Grey8(width_px, height_px, 0);
    case Picture::kWhite:
      return Grey8(width_px, height_px, 255);
    case Picture::kFocus:
      return draw_focus_chart(width_px, height_px);
    case Picture::kGrid:
      return draw_grid(setup);
    case Picture::kImage:
      return read_picture(png, width_px, height_px);
  }
  return std::nullopt;
}

std::optional<Grey8> draw_idle(const ProjectorOptions& options) {
  if (options.idle == Picture::kPattern) return std::nullopt;
  const std::uint8_t level = options.idle == Picture::kWhite ? 255 : 0;
  return Grey8(options.width_px, options.height_px, level);
}

}  // namespace slsd
