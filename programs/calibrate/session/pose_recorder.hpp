// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/calibrate/observe/observations.hpp"
#include "core/code/pattern.hpp"
#include "core/result.hpp"
#include "programs/calibrate/captures/captured_pictures.hpp"

namespace slsd {

/// Stores the pictures of a session losslessly in the folders that list_captures() reads. A pose is stored whole or not
/// at all.
/// @thread thread-bound
class PoseRecorder {
 public:
  /// @param folder   created with the first pose
  /// @param cameras  names; with several cameras, each has a folder within a pose's
  /// @errors kInvalidArgument: a camera's name cannot be a folder's name
  [[nodiscard]] static Result<PoseRecorder> create(std::filesystem::path folder, std::vector<std::string> cameras,
                                                   const Pattern& pattern);

  /// @param pictures  one for each camera
  /// @param views     the cameras whose pictures are stored
  /// @return the pose's name, "pose_NN" or "plane_NN"
  /// @errors of the files, and of encode_png()
  [[nodiscard]] Result<std::string> keep(PoseSubject subject, const std::vector<CapturedPictures>& pictures,
                                         const std::vector<PoseView>& views);

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

 private:
  PoseRecorder(std::filesystem::path folder, std::vector<std::string> cameras, std::string pattern)
      : folder_(std::move(folder)), cameras_(std::move(cameras)), pattern_(std::move(pattern)) {}
  [[nodiscard]] Result<> begin();

  std::filesystem::path folder_;
  std::vector<std::string> cameras_;
  std::string pattern_;  ///< a pattern file's text
  bool begun_ = false;   ///< the folder exists and contains the pattern
};

}  // namespace slsd
