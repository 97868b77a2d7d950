// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "core/cloud/shade_points.hpp"
#include "core/colour.hpp"
#include "core/result.hpp"
#include "daemon/scan/rig/frame_set.hpp"
#include "daemon/scan/scan_setup.hpp"

namespace slsd {

/// The light of the scene as one camera sees it, with the colours that it refers to. It stays where it is made.
struct SeenLight {
  SeenLight() = default;
  SeenLight(const SeenLight&) = delete;
  SeenLight& operator=(const SeenLight&) = delete;

  SceneLight light;
  ColourFrame white, dark;
};

/// Reads the light of one camera's frames, and its colours if they are wanted and it sees any.
/// @param camera  its index in the setup
/// @errors of Frame::colours(); kMismatch: colours of another size than their frame
[[nodiscard]] Result<> read_light(const FrameSet& set, const ScanSetup& setup, std::size_t camera, bool coloured,
                                  SeenLight& seen);

/// The factors that make the mean colour of these points grey. Empty: the mean lacks a colour. Saturated points are
/// left out.
/// @param applied  the factors in their colours
[[nodiscard]] std::optional<ColourGains> white_balance_of(std::span<const CloudPoint> points,
                                                          const ColourGains& applied);

}  // namespace slsd
