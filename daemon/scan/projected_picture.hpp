// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>

#include "core/image.hpp"
#include "core/result.hpp"
#include "daemon/configuration/projector_options.hpp"
#include "daemon/scan/scan_setup.hpp"
#include "drivers/camera/frame.hpp"

namespace slsd {

/// What a client may have the projector show.
enum class ProjectedPicture { kIdle, kPattern, kBlack, kWhite, kFocus, kGrid, kImage };

/// Their names in the protocol, in that order.
inline constexpr std::array<std::string_view, 7> kProjectedPictures{"idle",  "pattern", "black", "white",
                                                                    "focus", "grid",    "image"};

/// A picture is to be shown.
struct ProjectRequest {
  ProjectedPicture picture = ProjectedPicture::kIdle;
  std::string png;            ///< for kImage
  MonotonicTime deadline;     ///< for the projector to be ready
  std::stop_token gone = {};  ///< requested when nobody waits for the outcome any more
};

/// The picture in the projector's size; nothing for the pattern.
/// @param picture  not kIdle
/// @param png      for kImage, of that size
/// @errors kMalformed, kUnsupported: no image; kMismatch: of another size, or of 16 bits; kNotFound: a grid, and no
///         calibration
/// @thread reentrant
[[nodiscard]] Result<std::optional<Grey8>> draw_projected(ProjectedPicture picture, std::string_view png,
                                                          const ScanSetup& setup);

/// What the configuration has shown when nobody scans; nothing for the pattern. @thread reentrant
[[nodiscard]] std::optional<Grey8> draw_idle(const ProjectorOptions& options);

}  // namespace slsd
