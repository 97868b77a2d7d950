// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/recorded_clouds.hpp"

#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/calibration_file/calibration_file.hpp"
#include "drivers/files/file.hpp"

namespace slsd::model {
namespace {

using nlohmann::json;

constexpr std::size_t kLimitBytes = 1U << 28;
constexpr std::size_t kCloudLimitBytes = std::size_t{1} << 31;

/// Adds the clouds that scans.jsonl names.
/// @return  whether the last line is whole
bool add_clouds(std::string_view lines, RecordedClouds& recorded) {
  while (!lines.empty()) {
    const std::size_t end = lines.find('\n');
    const json line = json::parse(lines.substr(0, end), nullptr, false);
    if (end == std::string_view::npos || !line.is_object()) return false;
    lines.remove_prefix(end + 1);
    if (line.contains("cloud") && line["cloud"].is_string()) {
      recorded.names.push_back(line["cloud"].get<std::string>());
    } else if (line.contains("error")) {
      ++recorded.failed;
    }
  }
  return true;
}

/// recording.json counts the scans when the recording ends.
bool ended(std::string_view summary, std::size_t scans) {
  const json read = json::parse(summary, nullptr, false);
  return read.is_object() && read.contains("scans") && read["scans"].is_number_unsigned() &&
         read["scans"].get<std::size_t>() == scans;
}

}  // namespace

Result<RecordedClouds> read_recording(const std::filesystem::path& folder) {
  RecordedClouds recorded;
  recorded.folder = folder;
  const auto lines = read_file(folder / "scans.jsonl", kLimitBytes);
  if (!lines) {
    if (lines.error().code != ErrorCode::kNotFound) return tl::unexpected(lines.error());
    return fail(ErrorCode::kNotFound, "is not a recording: make one with slsctl record DIR --clouds --density pixels",
                folder.string());
  }
  const auto calibration = read_file(folder / "calibration.yml", kLimitBytes);
  if (!calibration) return tl::unexpected(calibration.error());
  auto read = read_calibration(*calibration, (folder / "calibration.yml").string());
  if (!read) return tl::unexpected(read.error());
  recorded.calibration = std::move(*read);
  const bool whole = add_clouds(*lines, recorded);
  if (recorded.names.empty())
    return fail(ErrorCode::kNotFound,
                "the recording has no clouds: make it with slsctl record DIR --clouds --density pixels",
                folder.string());
  const auto summary = read_file(folder / "recording.json", kLimitBytes);
  if (!whole || !summary || !ended(*summary, recorded.names.size()))
    recorded.warnings.push_back(
        fmt::format("the recording was cut: its first {} clouds are used", recorded.names.size()));
  return recorded;
}

Result<std::string> read_recorded(const RecordedClouds& recorded, const std::string& name) {
  return read_file(recorded.folder / name, kCloudLimitBytes);
}

}  // namespace slsd::model
