// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/calibrate/calibrate.hpp"
#include "programs/calibrate/captures/capture_folder.hpp"
#include "programs/calibrate/captures/pose_observer.hpp"

namespace slsd {

/// The observations in captures on disk, and the useless poses.
struct ReadCaptures {
  Observations observations;
  std::vector<PoseReport> refused;
};

/// Reads and observes the pictures of every pose.
/// @param names   of the cameras, the first one first; a folder's name, or the only camera's
/// @param observers  the plane's observer is used for captures of the plane
/// @param report  receives a line for each picture
/// @errors kMismatch: pictures of different sizes; kNotFound: a folder that matches no camera
[[nodiscard]] Result<ReadCaptures> read_captures(const std::vector<CapturedPose>& poses,
                                                 const std::vector<std::string>& names, const ImageSize& projector,
                                                 bool gray_code, PoseObservers& observers,
                                                 const std::function<void(const std::string&)>& report);

}  // namespace slsd
