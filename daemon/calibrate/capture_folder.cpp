// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/calibrate/capture_folder.hpp"

#include <algorithm>
#include <iterator>

namespace slsd {
namespace {

using std::filesystem::directory_iterator;
using std::filesystem::path;

constexpr char kLayout[] =
    "captures lie in DIR/pose_NN/white.png with pattern.png beside it, or with gray_00.png ... and black.png; with "
    "several cameras in DIR/pose_NN/CAMERA/";

std::vector<path> sorted_entries(const path& folder, bool folders) {
  std::vector<path> entries;
  std::error_code error;
  for (const auto& entry : directory_iterator(folder, error)) {
    if (entry.is_directory(error) == folders) entries.push_back(entry.path());
  }
  std::ranges::sort(entries);
  return entries;
}

path where_there(const path& file) {
  std::error_code ignored;
  return std::filesystem::exists(file, ignored) ? file : path();
}

Result<CaptureFiles> list_files(const path& folder, WhitePicture white) {
  CaptureFiles files{folder / "white.png", where_there(folder / "pattern.png"), {}, where_there(folder / "black.png")};
  if (white == WhitePicture::kOptional && !files.pattern.empty()) files.white = where_there(files.white);
  if (!files.white.empty() && where_there(files.white).empty()) {
    return fail(ErrorCode::kNotFound, std::string("is missing: the board under the white projector; ") + kLayout,
                files.white.string());
  }
  for (const path& file : sorted_entries(folder, false)) {
    if (file.filename().string().starts_with("gray_") && file.extension() == ".png") files.gray.push_back(file);
  }
  if (files.pattern.empty() && files.gray.empty()) {
    return fail(ErrorCode::kNotFound,
                std::string("has nothing projected: neither pattern.png nor gray_00.png; ") + kLayout, folder.string());
  }
  if (files.pattern.empty() && files.black.empty()) {
    return fail(ErrorCode::kNotFound, "is missing: a Gray code needs the board under the black projector too",
                (folder / "black.png").string());
  }
  return files;
}

Result<CapturedPose> list_pose(const path& folder, WhitePicture white, PoseSubject subject) {
  CapturedPose pose{folder.filename().string(), {}, subject};
  std::vector<path> cameras = sorted_entries(folder, true);
  const bool has_pictures = !where_there(folder / "white.png").empty() || !where_there(folder / "pattern.png").empty();
  if (cameras.empty() || has_pictures) cameras = {folder};
  for (const path& camera : cameras) {
    auto files = list_files(camera, white);
    if (!files) return tl::unexpected(files.error());
    pose.cameras[camera == folder ? std::string() : camera.filename().string()] = std::move(*files);
  }
  return pose;
}

Result<std::vector<CapturedPose>> list_subject(const path& folder, WhitePicture white, PoseSubject subject) {
  std::vector<CapturedPose> poses;
  for (const path& entry : sorted_entries(folder, true)) {
    if (!entry.filename().string().starts_with(folder_prefix(subject))) continue;
    auto pose = list_pose(entry, white, subject);
    if (!pose) return tl::unexpected(pose.error());
    poses.push_back(std::move(*pose));
  }
  return poses;
}

}  // namespace

std::string_view folder_prefix(PoseSubject subject) {
  return subject == PoseSubject::kBoard ? "pose_" : "plane_";
}

Result<std::vector<CapturedPose>> list_captures(const path& folder, WhitePicture white) {
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) {
    return fail(ErrorCode::kNotFound, std::string("is no folder; ") + kLayout, folder.string());
  }
  auto poses = list_subject(folder, white, PoseSubject::kBoard);
  if (poses && poses->empty()) {
    return fail(ErrorCode::kNotFound, std::string("holds no pose; ") + kLayout, folder.string());
  }
  return poses;
}

Result<std::vector<CapturedPose>> list_captures_with_planes(const path& folder, bool knows_plane) {
  auto poses = list_captures(folder);
  if (!poses) return poses;
  auto planes = list_subject(folder, WhitePicture::kNeeded, PoseSubject::kPlane);
  if (!planes) return planes;
  if (!planes->empty() && !knows_plane) {
    return fail(ErrorCode::kInvalidArgument,
                "is a look at a reference plane: name its print by --plane, or put the folder elsewhere",
                (folder / planes->front().name).string());
  }
  std::ranges::move(*planes, std::back_inserter(*poses));
  return poses;
}

}  // namespace slsd
