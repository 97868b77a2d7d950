// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>

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

}  // namespace slsd
