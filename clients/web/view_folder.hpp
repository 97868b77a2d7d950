// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace slsd::web {

/// A view of the board, as slsctl hand-eye keeps it: FOLDER/pose_NN[/CAMERA]/white.png and a line of FOLDER/poses.csv.
struct KeptView {
  std::string name;          ///< "pose_00"
  std::vector<double> pose;  ///< the robot's numbers
};

/// Lists the views of a folder in the order of its poses.csv. Skips lines of other names or with other text.
/// @return nothing if there is no such file
/// @thread reentrant
[[nodiscard]] std::vector<KeptView> views_in(const std::filesystem::path& folder);

/// Takes a view out of poses.csv, and removes its pictures.
/// @errors kNotFound: there is no such view; of the files
[[nodiscard]] Result<> erase_view(const std::filesystem::path& folder, std::string_view name);

/// Cameras of a view with a picture, by name; one without a folder of its own is "".
/// @param name  one of views_in()
/// @thread reentrant
[[nodiscard]] std::vector<std::string> cameras_of_view(const std::filesystem::path& folder, std::string_view name);

/// Reads the picture of a camera. Names are compared with those of the folder and never become part of a path unseen.
/// @errors kNotFound: there is no such view or camera; of the file
/// @thread reentrant
[[nodiscard]] Result<std::string> picture_of_view(const std::filesystem::path& folder, std::string_view name,
                                                  std::string_view camera);

}  // namespace slsd::web
