// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/live_clouds.hpp"

#include <sys/stat.h>

#include <cerrno>
#include <cstdlib>
#include <system_error>
#include <utility>

#include <nlohmann/json.hpp>

#include "clients/connection/passing.hpp"
#include "core/calibration_file/calibration_file.hpp"
#include "drivers/files/file.hpp"
#include "drivers/recording/layout.hpp"
#include "drivers/system/system_error.hpp"
#include "rpc/message.hpp"

namespace slsd::model {
namespace {

using nlohmann::json;
using std::filesystem::path;

constexpr std::size_t kLargestBytes = std::size_t{1} << 31;

Result<path> make_temporary_folder() {
  std::error_code error;
  const path parent = std::filesystem::temp_directory_path(error);
  if (error) return fail_system(error.value(), "cannot find a temporary folder: set TMPDIR", parent);
  std::string name = (parent / "slsd-model-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) return fail_system(errno, "cannot create a folder", name);
  return path(name);
}

/// The room on the disk that the files of a folder take.
std::uintmax_t disk_bytes(const path& folder) {
  constexpr std::uintmax_t kBlockBytes = 512;
  std::uintmax_t bytes = 0;
  std::error_code error;
  for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    struct stat about {};
    if (::stat(at->path().c_str(), &about) == 0) bytes += kBlockBytes * static_cast<std::uintmax_t>(about.st_blocks);
  }
  return bytes;
}

bool on_one_disk(const path& a, const path& b) {
  struct stat of_a {
  }, of_b{};
  return ::stat(a.c_str(), &of_a) == 0 && ::stat(b.c_str(), &of_b) == 0 && of_a.st_dev == of_b.st_dev;
}

/// The result of a reply, or its error as a value.
Result<json> result_of(Result<Answered> answered) {
  if (!answered) return tl::unexpected(answered.error());
  json& message = answered->reply.message;
  if (message.contains("error"))
    return fail(ErrorCode::kIo, message["error"].value("message", "the service refused the request"));
  return std::move(message["result"]);
}

}  // namespace

LiveClouds::LiveClouds(Connection connection, Calibration calibration, path folder, bool temporary)
    : connection_(std::move(connection)),
      calibration_(std::move(calibration)),
      folder_(std::move(folder)),
      temporary_(temporary) {}

LiveClouds::~LiveClouds() {
  std::error_code ignored;
  if (temporary_ && !folder_.empty()) std::filesystem::remove_all(folder_, ignored);
}

Result<LiveClouds> LiveClouds::open(const path& socket, const std::optional<path>& folder) {
  auto connection = Connection::open(socket);
  if (!connection) return tl::unexpected(connection.error());
  const auto settings = result_of(connection->call("settings", json::object()));
  if (!settings) return tl::unexpected(settings.error());
  const std::string text = settings->value("calibration", "");
  if (text.empty()) return fail(ErrorCode::kNotFound, "the scanner is not calibrated: run slsd --calibrate");
  auto calibration = read_calibration(text, "the service's calibration");
  if (!calibration) return tl::unexpected(calibration.error());
  auto made = folder ? make_empty_folder(*folder).map([&] { return *folder; }) : make_temporary_folder();
  if (!made) return tl::unexpected(made.error());
  LiveClouds clouds(std::move(*connection), std::move(*calibration), *made, !folder);
  Result<> begun = make_folder(*made / "clouds");
  if (begun) begun = write_file_atomically(*made / "calibration.yml", text);
  if (!begun) return tl::unexpected(begun.error());
  clouds.lines_.open(*made / "scans.jsonl", std::ios::app);
  if (!clouds.lines_) return fail_system(errno, "cannot write", *made / "scans.jsonl");
  return clouds;
}

Result<> LiveClouds::request() {
  // A configured stride or voxel_mm would take the neighbours from which surfaces are made.
  json params{{"format", "ply"}, {"density", "pixels"}, {"coordinate_frame", "rig"}, {"stride", 1}, {"voxel_mm", 0}};
  if (colour_) params["colour"] = true;
  return connection_.request("scan", std::move(params));
}

Result<std::optional<std::string>> LiveClouds::receive() {
  auto answered = connection_.reply();
  if (!answered) return tl::unexpected(answered.error());
  const json& message = answered->reply.message;
  if (!message.contains("error")) return std::optional(std::string(answered->reply.bytes.view()));
  const json& error = message["error"];
  problem_ = error.value("message", "the scan failed");
  const std::string name = error.contains("data") ? error["data"].value("name", "") : "";
  if (!passes(name)) return fail(ErrorCode::kIo, problem_);
  return std::optional<std::string>();
}

Result<std::string> LiveClouds::keep(std::string_view ply) {
  const std::string name = "clouds/" + numbered(kept_, ".ply");
  if (auto written = write_file_atomically(folder_ / name, ply); !written) return tl::unexpected(written.error());
  errno = 0;
  lines_ << to_line({{"cloud", name}}) << std::flush;
  if (!lines_) return fail_system(errno == 0 ? EIO : errno, "cannot write", folder_ / "scans.jsonl");
  ++kept_;
  return name;
}

Result<std::string> LiveClouds::read(const std::string& name) const {
  return read_file(folder_ / name, kLargestBytes);
}

Result<> LiveClouds::finish() {
  return write_file_atomically(folder_ / "recording.json", json{{"scans", kept_}}.dump() + "\n");
}

bool LiveClouds::make_room(const path& file, std::uintmax_t bytes) {
  std::error_code error;
  if (!temporary_ || std::filesystem::is_symlink(file, error)) return false;
  const path place = file.has_parent_path() ? file.parent_path() : path(".");
  const auto space = std::filesystem::space(place, error);
  if (error || !on_one_disk(place, folder_)) return false;
  // A limit on the user's files, and no full disk, leaves room for the file.
  const std::uintmax_t needed = bytes + bytes / 16;
  if (space.available >= needed || space.available + disk_bytes(folder_ / "clouds") < needed) return false;
  return std::filesystem::remove_all(folder_ / "clouds", error) > 0 && !error;
}

path LiveClouds::keep_folder() {
  std::error_code error;
  if (!std::filesystem::exists(folder_ / "clouds", error)) return {};
  temporary_ = false;
  return folder_;
}

}  // namespace slsd::model
