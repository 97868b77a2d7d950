// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/code/pattern.hpp"
#include "core/geometry/calibration.hpp"
#include "core/result.hpp"
#include "drivers/files/grey_image.hpp"
#include "tests/corpus/truth.hpp"

namespace slsd {

/// A frame, what took it, and what it shows.
struct Scene {
  Pattern pattern;
  Calibration calibration;
  GreyImage frame;
  std::vector<CellTruth> truth;
};

/// Reads a folder of tests/corpus. @errors as the files' readers
[[nodiscard]] Result<Scene> read_scene(std::string_view folder);

/// The pattern itself as the frame: what a camera with the projector's lens, 180 mm beside it, sees of a plane at 2 m,
/// its principal point moved so that the pattern lands on its own pixels.
/// @param pattern  name of a file in config/patterns, without .toml @errors as the file's reader
[[nodiscard]] Result<Scene> scene_of_pattern(std::string_view pattern);

}  // namespace slsd
