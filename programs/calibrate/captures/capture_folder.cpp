// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/captures/capture_folder.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <iterator>

namespace slsd {
namespace {

using std::filesystem::directory_iterator;
using std::filesystem::path;

constexpr char kLayout[] =
    "captures are DIR/pose_NN/white.png with pattern.png, or with gray_00.png ... and black.png; with several cameras "
    "in DIR/pose_NN/CAMERA/";

std::vector<path> sorted_entries(const path& folder, bool folders) {
  std::vector<path> entries;
  std::error_code error;
  for (const auto& entry : directory_iterator(folder, error)) {
    if (entry.is_directory(error) == folders) entries.push_back(entry.path());
  }
  std::ranges::sort(entries);
  return entries;
}

constexpr std::array kExtensions{".png", ".tif", ".tiff", ".pgm", ".ppm", ".jpg", ".jpeg"};

/// The rank of the file's extension among the readable ones; their number if it is not readable.
std::size_t rank_of(const path& file) {
  return static_cast<std::size_t>(std::ranges::find(kExtensions, extension_of(file)) - kExtensions.begin());
}

bool is_picture(const path& file) {
  return rank_of(file) < kExtensions.size();
}

/// The picture of this name in any readable format; empty if there is none.
path where_there(const path& folder, const std::string& name) {
  path found;
  for (const path& file : sorted_entries(folder, false)) {
    if (file.stem() != name || !is_picture(file)) continue;
    if (found.empty() || rank_of(file) < rank_of(found)) found = file;
  }
  return found;
}

Error lacking(const std::string& message, const path& where) {
  return {ErrorCode::kNotFound, message, where.string()};
}

CaptureFiles list_files(const path& folder, WhitePicture white) {
  CaptureFiles files{
      where_there(folder, "white"), where_there(folder, "pattern"), {}, where_there(folder, "black"), {}};
  for (const path& file : sorted_entries(folder, false)) {
    if (file.filename().string().starts_with("gray_") && is_picture(file)) files.gray.push_back(file);
  }
  if (files.white.empty() && !(white == WhitePicture::kOptional && !files.pattern.empty())) {
    files.lack = lacking(std::string("is missing: a picture of the board in the projector's white light; ") + kLayout,
                         folder / "white.png");
  } else if (files.pattern.empty() && files.gray.empty()) {
    files.lack =
        lacking(std::string("lacks a projected image: neither pattern.png nor gray_00.png; ") + kLayout, folder);
  } else if (files.pattern.empty() && files.black.empty()) {
    files.lack = lacking("is missing: a Gray code also needs a picture of the board while the projector shows black",
                         folder / "black.png");
  }
  return files;
}

CapturedPose list_pose(const path& folder, WhitePicture white, PoseSubject subject) {
  CapturedPose pose{folder.filename().string(), {}, subject};
  std::vector<path> cameras = sorted_entries(folder, true);
  const bool has_pictures = !where_there(folder, "white").empty() || !where_there(folder, "pattern").empty();
  if (cameras.empty() || has_pictures) cameras = {folder};
  for (const path& camera : cameras) {
    pose.cameras[camera == folder ? std::string() : camera.filename().string()] = list_files(camera, white);
  }
  return pose;
}

std::vector<CapturedPose> list_subject(const path& folder, WhitePicture white, PoseSubject subject) {
  std::vector<CapturedPose> poses;
  for (const path& entry : sorted_entries(folder, true)) {
    if (!entry.filename().string().starts_with(folder_prefix(subject))) continue;
    poses.push_back(list_pose(entry, white, subject));
  }
  return poses;
}

}  // namespace

Result<> check_camera_folders(const std::vector<std::string>& cameras) {
  if (cameras.size() < 2) return {};
  for (const std::string& name : cameras) {
    if (name.find('/') == std::string::npos && name != "." && name != "..") continue;
    return fail(ErrorCode::kInvalidArgument, "cannot be the name of a folder for its pictures: rename the camera",
                "camera " + name);
  }
  return {};
}

std::string extension_of(const path& file) {
  std::string extension = file.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

std::string_view folder_prefix(PoseSubject subject) {
  return subject == PoseSubject::kBoard ? "pose_" : "plane_";
}

Result<std::vector<CapturedPose>> list_captures(const path& folder, WhitePicture white) {
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) {
    return fail(ErrorCode::kNotFound, std::string("is not a folder; ") + kLayout, folder.string());
  }
  auto poses = list_subject(folder, white, PoseSubject::kBoard);
  if (poses.empty()) {
    return fail(ErrorCode::kNotFound, std::string("has no pose; ") + kLayout, folder.string());
  }
  return poses;
}

Result<std::vector<CapturedPose>> list_captures_with_planes(const path& folder, bool knows_plane) {
  auto poses = list_captures(folder);
  if (!poses) return poses;
  auto planes = list_subject(folder, WhitePicture::kNeeded, PoseSubject::kPlane);
  if (!planes.empty() && !knows_plane) {
    return fail(ErrorCode::kInvalidArgument,
                "is a view of a reference plane: name its print with --plane, or move the folder elsewhere",
                (folder / planes.front().name).string());
  }
  std::ranges::move(planes, std::back_inserter(*poses));
  return poses;
}

}  // namespace slsd
