// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/session/pose_recorder.hpp"

#include <system_error>

#include <fmt/format.h>

#include "drivers/files/encode_png.hpp"
#include "drivers/files/file.hpp"
#include "programs/calibrate/captures/capture_folder.hpp"

namespace slsd {
namespace {

using std::filesystem::path;

constexpr char kUnfinished[] = ".unfinished";

Result<> failed(const path& where, const std::error_code& error) {
  const ErrorCode code = error == std::errc::no_space_on_device  ? ErrorCode::kNoSpace
                         : error == std::errc::permission_denied ? ErrorCode::kPermissionDenied
                                                                 : ErrorCode::kIo;
  return fail(code, error.message() + ": choose another folder with --record", where.string());
}

Result<> make_pose_folder(const path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  return error ? failed(folder, error) : Result<>();
}

Result<> write_picture(const path& file, const GreyImage& picture) {
  const auto png = encode_png(view(picture));
  if (!png) return tl::unexpected(png.error());
  return write_file_atomically(file, *png);
}

Result<> write_pictures(const path& folder, const CapturedPictures& pictures) {
  if (auto made = make_pose_folder(folder); !made) return made;
  if (auto white = write_picture(folder / "white.png", pictures.white); !white) return white;
  for (std::size_t i = 0; i < pictures.coded.size(); ++i) {
    const std::string name = pictures.black ? fmt::format("gray_{:02}.png", i) : "pattern.png";
    if (auto coded = write_picture(folder / name, pictures.coded[i]); !coded) return coded;
  }
  return pictures.black ? write_picture(folder / "black.png", *pictures.black) : Result<>();
}

path free_name(const path& folder, PoseSubject subject) {
  std::error_code ignored;
  for (int number = 0;; ++number) {
    path pose = folder / fmt::format("{}{:02}", folder_prefix(subject), number);
    if (!std::filesystem::exists(pose, ignored)) return pose;
  }
}

}  // namespace

Result<PoseRecorder> PoseRecorder::create(path folder, std::vector<std::string> cameras, const Pattern& pattern) {
  if (auto fit = check_camera_folders(cameras); !fit) return tl::unexpected(fit.error());
  return PoseRecorder(std::move(folder), std::move(cameras), write_pattern(pattern));
}

Result<> PoseRecorder::begin() {
  if (begun_) return {};
  if (auto made = make_pose_folder(folder_); !made) return made;
  if (auto written = write_file_atomically(folder_ / "pattern.toml", pattern_); !written) return written;
  begun_ = true;
  return {};
}

Result<std::string> PoseRecorder::keep(PoseSubject subject, const std::vector<CapturedPictures>& pictures,
                                       const std::vector<PoseView>& views) {
  if (auto begun = begin(); !begun) return tl::unexpected(begun.error());
  const path unfinished = folder_ / kUnfinished, pose = free_name(folder_, subject);
  std::error_code error;
  std::filesystem::remove_all(unfinished, error);
  if (error) return tl::unexpected(failed(unfinished, error).error());
  for (const PoseView& seen : views) {
    const path place = cameras_.size() > 1 ? unfinished / cameras_[seen.camera] : unfinished;
    if (auto written = write_pictures(place, pictures[seen.camera]); !written) return tl::unexpected(written.error());
  }
  std::filesystem::rename(unfinished, pose, error);
  if (error) return tl::unexpected(failed(pose, error).error());
  return pose.filename().string();
}

}  // namespace slsd
