// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/calibrate/observe/observations.hpp"
#include "core/result.hpp"

namespace slsd {

/// The files of one camera's view of one pose.
struct CaptureFiles {
  std::filesystem::path white;              ///< empty if there is none and none is needed
  std::filesystem::path pattern;            ///< empty if there is none
  std::vector<std::filesystem::path> gray;  ///< in the code's order; empty without a Gray code
  std::filesystem::path black;              ///< empty if there is none
  std::optional<Error> lack;                ///< a missing file that this view needs
};

struct CapturedPose {
  std::string name;                             ///< "pose_00"
  std::map<std::string, CaptureFiles> cameras;  ///< files by folder's name; "" if the pose has no folders
  PoseSubject subject = PoseSubject::kBoard;
};

/// Need for white.png in a pose. Without it the board is not visible, but a plane can be measured.
enum class WhitePicture { kNeeded, kOptional };

/// Lists the captures in a folder:
///
///     DIR/pose_NN[/CAMERA]/white.png, and pattern.png or gray_00.png, gray_01.png ... with black.png
///
/// @return the poses in the order of their names
/// @errors kNotFound: no folder, no pose, no white.png (a Gray code always needs it) or no projected picture in a pose;
///         the message names the file
[[nodiscard]] Result<std::vector<CapturedPose>> list_captures(const std::filesystem::path& folder,
                                                              WhitePicture white = WhitePicture::kNeeded);

/// Lists the captures, followed by the views of the reference plane in DIR/plane_NN, if any.
/// @param knows_plane  whether its print is known
/// @errors kInvalidArgument: there are views of an unknown plane
[[nodiscard]] Result<std::vector<CapturedPose>> list_captures_with_planes(const std::filesystem::path& folder,
                                                                          bool knows_plane);

/// Checks that pictures of several cameras can have folders of the cameras' names.
/// @errors kInvalidArgument: names the camera
[[nodiscard]] Result<> check_camera_folders(const std::vector<std::string>& cameras);

/// The extension of a picture's file in lower case, because cameras also write .JPG.
[[nodiscard]] std::string extension_of(const std::filesystem::path& file);

/// The beginning of the folders' names: "pose_" or "plane_".
[[nodiscard]] std::string_view folder_prefix(PoseSubject subject);

}  // namespace slsd
