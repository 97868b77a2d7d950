// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/rig/projected_picture.hpp"

#include "drivers/files/picture_process.hpp"
#include "drivers/system/own_program.hpp"
#include "picture/focus_chart.hpp"
#include "picture/view_grid.hpp"

namespace slsd {
namespace {

Result<std::optional<Grey8>> draw_grid(const ScanSetup& setup) {
  if (setup.calibration) return draw_view_grid(*setup.calibration, setup.depth_min_mm, setup.depth_max_mm);
  return fail(ErrorCode::kNotFound, "the grid needs a calibration: calibrate first");
}

}  // namespace

Result<std::optional<Grey8>> draw_projected(Picture picture, std::string_view png, const ScanSetup& setup,
                                            MonotonicTime until) {
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
      return decode_in_process(png, width_px, height_px, until, find_own_program("slsd-picture"));
  }
  return std::nullopt;
}

std::optional<Grey8> draw_idle(const ProjectorOptions& options) {
  if (options.idle == Picture::kPattern) return std::nullopt;
  const std::uint8_t level = options.idle == Picture::kWhite ? 255 : 0;
  return Grey8(options.width_px, options.height_px, level);
}

}  // namespace slsd
