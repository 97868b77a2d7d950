// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/session/session_record.hpp"
#include "core/utc_text.hpp"

#include <string>
#include <system_error>

#include "daemon/scan/scan_setup.hpp"
#include "programs/calibrate/captures/capture_folder.hpp"
#include "programs/calibrate/captures/captured_pattern.hpp"

namespace slsd {

using std::filesystem::path;

path record_folder(const CalibrateRequest& request, const path& file) {
  if (!request.record.empty()) return request.record;
  std::string time = utc_text(std::chrono::system_clock::now());
  std::erase_if(time, [](char letter) { return letter == '-' || letter == ':'; });
  return file.parent_path() / ("calibration-" + time);
}

bool holds_poses(const path& folder) {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (entry.path().filename().string().starts_with("pose_")) return true;
  }
  return false;
}

Result<Pattern> session_pattern(const path& folder, const Configuration& configuration) {
  if (!holds_poses(folder)) return configured_pattern(configuration);
  auto pattern = captured_pattern(folder, configuration);
  if (!pattern) return pattern;
  const ProjectorOptions& projector = configuration.projector;
  if (pattern->options.projector_width_px == projector.width_px &&
      pattern->options.projector_height_px == projector.height_px) {
    return pattern;
  }
  return fail(ErrorCode::kMismatch,
              "holds the pattern of a projector of another size than the configured one: start again in another folder",
              folder.string());
}

Result<ReadCaptures> read_record(const path& folder, const std::vector<std::string>& cameras,
                                 const ImageSize& projector, bool gray_code, PoseObservers& observers,
                                 const std::function<void(const std::string&)>& report) {
  std::vector<CapturedPose> poses;
  if (holds_poses(folder)) {
    auto listed = list_captures_with_planes(folder, observers.plane.has_value());
    if (!listed) return tl::unexpected(listed.error());
    if (captured_in_gray(*listed) != gray_code) {
      return fail(ErrorCode::kMismatch,
                  gray_code
                      ? "holds poses of the pattern: continue without --code gray, or start again in another folder"
                      : "holds poses of a Gray code: continue with --code gray, or start again in another folder",
                  folder.string());
    }
    poses = std::move(*listed);
  }
  return read_captures(poses, cameras, projector, gray_code, observers, report);
}

}  // namespace slsd
