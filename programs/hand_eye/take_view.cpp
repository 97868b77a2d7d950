// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/hand_eye/take_view.hpp"

#include <system_error>

#include <fmt/format.h>

#include "drivers/files/encode_png.hpp"
#include "drivers/files/file.hpp"
#include "programs/calibrate/captures/capture_folder.hpp"
#include "programs/hand_eye/poses_file.hpp"

namespace slsd {
namespace {

using std::filesystem::path;

std::string free_name_in(const path& folder) {
  std::error_code ignored;
  for (int number = 0;; ++number) {
    std::string name = fmt::format("{}{:02}", folder_prefix(PoseSubject::kBoard), number);
    if (!std::filesystem::exists(folder / name, ignored)) return name;
  }
}

/// @return  nothing if there is no file
/// @errors of the file, if it is no file of poses
Result<std::optional<std::string>> lines_so_far(const path& file) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return std::nullopt;
  auto text = read_file(file, kPosesFileMaxBytes);
  if (!text) return tl::unexpected(text.error());
  const auto poses = read_poses(*text, file.string());
  if (!poses) return tl::unexpected(poses.error());
  return std::move(*text);
}

Result<> write_white(const path& folder, const GreyImage& picture) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return fail(ErrorCode::kIo, error.message() + ": choose another folder with --from", folder.string());
  const auto png = encode_png(view(picture));
  if (!png) return tl::unexpected(png.error());
  return write_file_atomically(folder / "white.png", *png);
}

Result<> write_view(const path& folder, const TakenView& view, const std::vector<std::string>& cameras,
                    const std::vector<GreyImage>& pictures, std::span<const double> numbers) {
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const path own = pictures.size() > 1 ? folder / view.name / cameras[i] : folder / view.name;
    if (auto written = write_white(own, pictures[i]); !written) return written;
  }
  std::string lines = view.lines_before.value_or("");
  if (!lines.empty() && !lines.ends_with('\n')) lines += '\n';
  lines += view.name;
  for (const double number : numbers) lines += fmt::format(",{:.10g}", number);
  return write_file_atomically(folder / "poses.csv", lines + '\n');
}

}  // namespace

Result<TakenView> take_view(PoseSource& source, const path& folder, std::span<const double> numbers,
                            const PoseNotation& notation) {
  if (const auto pose = read_robot_pose(numbers, notation); !pose)
    return fail(pose.error().code, pose.error().message, "--pose");
  if (auto fit = check_camera_folders(source.cameras()); !fit) return tl::unexpected(fit.error());
  auto lines = lines_so_far(folder / "poses.csv");
  if (!lines) return tl::unexpected(lines.error());
  source.show(Grey8(source.projector().width_px, source.projector().height_px, 255));
  const auto pictures = source.grab();
  if (!pictures) return tl::unexpected(pictures.error());
  TakenView view{free_name_in(folder), std::move(*lines)};
  if (auto written = write_view(folder, view, source.cameras(), *pictures, numbers); !written) {
    (void)drop_view(folder, view);
    return tl::unexpected(written.error());
  }
  return view;
}

Result<> drop_view(const path& folder, const TakenView& view) {
  std::error_code error;
  std::filesystem::remove_all(folder / view.name, error);
  if (!view.lines_before) std::filesystem::remove(folder / "poses.csv", error);
  if (error) return fail(ErrorCode::kIo, error.message(), folder.string());
  return view.lines_before ? write_file_atomically(folder / "poses.csv", *view.lines_before) : Result<>();
}

}  // namespace slsd
