// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <stop_token>
#include <string>
#include <string_view>

#include "core/image.hpp"
#include "core/result.hpp"
#include "core/shown_picture.hpp"
#include "daemon/configuration/projector_options.hpp"
#include "daemon/scan/scan_setup.hpp"
#include "drivers/camera/frame.hpp"

namespace slsd {

/// A request to show a picture.
struct ProjectRequest {
  Picture picture = Picture::kIdle;  ///< not kHeld
  std::string png;                   ///< the image, if the picture is kImage
  MonotonicTime deadline;            ///< end of the wait for the projector
  std::stop_token gone = {};         ///< requested when nobody waits for the outcome any more
};

/// Draws the picture in the projector's size; nothing for the pattern.
/// @param picture  neither kIdle nor kHeld
/// @param png      for kImage, in the projector's size; an unprivileged process decodes it
/// @param until    the end of the time for decoding
/// @errors those of decode_in_process(); kNotFound: a grid without a calibration
/// @thread reentrant
[[nodiscard]] Result<std::optional<Grey8>> draw_projected(Picture picture, std::string_view png, const ScanSetup& setup,
                                                          MonotonicTime until);

/// Draws the configured idle picture, shown when nobody scans. Empty for the pattern. @thread reentrant
[[nodiscard]] std::optional<Grey8> draw_idle(const ProjectorOptions& options);

}  // namespace slsd
