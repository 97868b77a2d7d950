// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/slsctl/recording.hpp"

#include <cerrno>
#include <system_error>

#include "drivers/files/encode_png.hpp"
#include "drivers/files/file.hpp"
#include "drivers/system/system_error.hpp"
#include "rpc/message.hpp"

namespace slsd {
namespace {

using nlohmann::json;
using std::filesystem::path;

Result<const Received*> find_frame(const Answered& scan, const std::string& camera) {
  for (const Received& event : scan.events) {
    const bool frame = event.message.value("method", "") == "frame" && event.message.contains("params");
    if (frame && event.message["params"].value("camera", "") == camera) return &event;
  }
  return fail(ErrorCode::kMalformed, "the service sent no frame of camera \"" + camera + "\": it is older than slsctl");
}

}  // namespace

Recording::Recording(path folder, json settings, bool clouds)
    : folder_(std::move(folder)),
      settings_(std::move(settings)),
      clouds_(clouds),
      cameras_(recorded_cameras(settings_)) {}

Result<Recording> Recording::create(const path& folder, json settings, bool clouds) {
  // A replay takes every image in the folder.
  if (auto made = make_empty_folder(folder); !made) return tl::unexpected(made.error());
  Recording recording(folder, std::move(settings), clouds);
  if (auto made = recording.make_folders(); !made) return tl::unexpected(made.error());
  if (auto written = recording.write_settings(); !written) return tl::unexpected(written.error());
  recording.lines_.open(folder / "scans.jsonl", std::ios::app);
  if (!recording.lines_) return tl::unexpected(system_error(errno, "cannot write", folder / "scans.jsonl"));
  return recording;
}

Result<> Recording::make_folders() const {
  Result<> made;
  for (const RecordedCamera& camera : cameras_) {
    if (made) made = make_folder(folder_ / camera.folder);
  }
  if (made && clouds_) made = make_folder(folder_ / "clouds");
  return made;
}

Result<> Recording::write_settings() {
  Result<> written = write("pattern.toml", settings_.value("pattern", ""));
  if (written) written = write("calibration.yml", settings_.value("calibration", ""));
  if (written && settings_.contains("hand_eye_file"))
    written = write("hand_eye.yml", settings_.value("hand_eye_file", ""));
  if (written) written = write("slsd.toml", replay_configuration(settings_, cameras_));
  for (std::size_t i = 0; i < cameras_.size(); ++i) settings_["cameras"][i]["folder"] = cameras_[i].folder;
  settings_.erase("pattern");
  settings_.erase("calibration");
  settings_.erase("hand_eye_file");
  return written ? write_summary() : written;
}

Result<> Recording::write_summary() {
  settings_["scans"] = scans_;
  settings_["failed"] = failures_;
  return write("recording.json", settings_.dump(2) + "\n");
}

Result<> Recording::write(const std::string& name, std::string_view bytes) {
  if (auto written = write_file_atomically(folder_ / name, bytes); !written) return written;
  bytes_ += bytes.size();
  return {};
}

Result<> Recording::write_line(const json& line) {
  errno = 0;
  lines_ << to_line(line) << std::flush;
  if (lines_) return {};
  return tl::unexpected(system_error(errno == 0 ? EIO : errno, "cannot write", folder_ / "scans.jsonl"));
}

Result<json> Recording::write_frame(const RecordedCamera& camera, const Answered& scan) {
  const auto frame = find_frame(scan, camera.name);
  if (!frame) return tl::unexpected(frame.error());
  const auto image = (*frame)->image((*frame)->message["params"]);
  if (!image) return tl::unexpected(image.error());
  const auto png = encode_png(*image);
  if (!png) return tl::unexpected(png.error());
  json line = (*frame)->message["params"];
  for (const char* key : {"bytes", "scan", "format"}) line.erase(key);
  line["file"] = camera.folder + "/" + numbered(scans_, ".png");
  if (auto written = write(line["file"], *png); !written) return tl::unexpected(written.error());
  return line;
}

Result<> Recording::write_scan(const Answered& scan, json& line) {
  for (const RecordedCamera& camera : cameras_) {
    auto frame = write_frame(camera, scan);
    if (!frame) return tl::unexpected(frame.error());
    line["frames"].push_back(std::move(*frame));
  }
  if (!clouds_) return write_line(line);
  line["cloud"] = "clouds/" + numbered(scans_, ".ply");
  if (auto written = write(line["cloud"], scan.reply.bytes); !written) return written;
  return write_line(line);
}

void Recording::remove_scan() const {
  std::error_code ignored;
  for (const RecordedCamera& camera : cameras_) {
    std::filesystem::remove(folder_ / camera.folder / numbered(scans_, ".png"), ignored);
  }
  std::filesystem::remove(folder_ / "clouds" / numbered(scans_, ".ply"), ignored);
}

Result<> Recording::add(const Answered& scan) {
  json line = scan.reply.message["result"];
  for (const char* key : {"bytes", "format"}) line.erase(key);
  Result<> written = write_scan(scan, line);
  if (written) {
    ++scans_;
  } else {
    remove_scan();
  }
  return written;
}

Result<> Recording::add_failure(const json& error) {
  ++failures_;
  return write_line({{"error", error}});
}

Result<> Recording::finish() {
  return write_summary();
}

}  // namespace slsd
