// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/web/view_folder.hpp"

#include <algorithm>
#include <charconv>
#include <optional>
#include <system_error>
#include <utility>

#include "drivers/files/file.hpp"

namespace slsd::web {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPosesBytesMax = 1 << 20;
constexpr std::size_t kPictureBytesMax = 128 << 20;
constexpr std::string_view kPrefix = "pose_";
constexpr std::string_view kDigits = "0123456789";

bool is_view_name(std::string_view name) {
  return name.starts_with(kPrefix) && name.size() > kPrefix.size() && name.size() < 20 &&
         name.substr(kPrefix.size()).find_first_not_of(kDigits) == std::string_view::npos;
}

std::vector<std::string> lines_of_poses(const fs::path& folder) {
  std::vector<std::string> lines;
  const auto text = read_file(folder / "poses.csv", kPosesBytesMax);
  for (std::size_t at = 0; text && at < text->size();) {
    const std::size_t end = std::min(text->find('\n', at), text->size());
    lines.push_back(text->substr(at, end - at));
    at = end + 1;
  }
  return lines;
}

std::optional<KeptView> view_of_line(std::string_view line) {
  KeptView view{std::string(line.substr(0, line.find(','))), {}};
  if (!is_view_name(view.name)) return std::nullopt;
  for (std::size_t at = view.name.size(); at < line.size();) {
    const std::size_t begin = at + 1, end = std::min(line.find(',', begin), line.size());
    double number = 0;
    const auto [stop, wrong] = std::from_chars(line.data() + begin, line.data() + end, number);
    if (wrong != std::errc() || stop != line.data() + end) return std::nullopt;
    view.pose.push_back(number);
    at = end;
  }
  return view;
}

bool is_kept(const fs::path& folder, std::string_view name) {
  const auto views = views_in(folder);
  return std::ranges::find(views, name, &KeptView::name) != views.end();
}

}  // namespace

std::vector<KeptView> views_in(const fs::path& folder) {
  std::vector<KeptView> views;
  for (const std::string& line : lines_of_poses(folder)) {
    if (auto view = view_of_line(line)) views.push_back(std::move(*view));
  }
  return views;
}

Result<> erase_view(const fs::path& folder, std::string_view name) {
  if (!is_kept(folder, name))
    return fail(ErrorCode::kNotFound, "there is no such view: choose one from the list", std::string(name));
  std::string text;
  for (const std::string& line : lines_of_poses(folder)) {
    if (std::string_view(line).substr(0, line.find(',')) != name) text += line + "\n";
  }
  // The line goes first: pictures without a line are skipped, but a line without its pictures is an error.
  if (auto written = write_file_atomically(folder / "poses.csv", text); !written) return written;
  std::error_code error;
  fs::remove_all(folder / name, error);
  if (!error && views_in(folder).empty()) fs::remove(folder / "poses.csv", error);
  if (error) return fail(ErrorCode::kIo, error.message(), folder.string());
  return {};
}

std::vector<std::string> cameras_of_view(const fs::path& folder, std::string_view name) {
  std::error_code error;
  if (fs::exists(folder / name / "white.png", error)) return {""};
  std::vector<std::string> cameras;
  for (fs::directory_iterator at(folder / name, error), end; !error && at != end; at.increment(error)) {
    std::error_code ignored;
    if (fs::exists(at->path() / "white.png", ignored)) cameras.push_back(at->path().filename().string());
  }
  std::ranges::sort(cameras);
  return cameras;
}

Result<std::string> picture_of_view(const fs::path& folder, std::string_view name, std::string_view camera) {
  if (is_kept(folder, name)) {
    for (const std::string& each : cameras_of_view(folder, name)) {
      if (each == camera || each.empty()) return read_file(folder / name / each / "white.png", kPictureBytesMax);
    }
  }
  return fail(ErrorCode::kNotFound, "there is no such picture: choose a view from the list", std::string(name));
}

}  // namespace slsd::web
