// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "core/calibration_file/calibration_file.hpp"
#include "core/calibration_file/hand_eye_file.hpp"
#include "core/cloud/ply.hpp"
#include "core/shown_picture.hpp"
#include "core/utc_text.hpp"
#include "daemon/bundle/bundle.hpp"
#include "daemon/configuration/configuration.hpp"
#include "daemon/server/methods/scan_json.hpp"
#include "drivers/camera/frame_image.hpp"
#include "drivers/files/encode_png.hpp"
#include "drivers/recording/layout.hpp"
#include "rpc/message.hpp"

namespace slsd {
namespace {

using nlohmann::json;

/// A name in CSV: quoted, with its quotes doubled.
std::string csv_field(const std::string& text) {
  std::string field = "\"";
  for (const char c : text) field.append(c == '"' ? 2 : 1, c);
  return field + '"';
}

/// Lists every region that gave no point: its place, and the rules that explain it.
std::string reasons_csv(const ScanResult& scan, const KeptSettings& settings) {
  std::string text = "camera,u,v,status,rule,guard\n";
  for (const RegionReason& reason : scan.reasons) {
    text += fmt::format("{},{:.2f},{:.2f},{},{},{}\n", csv_field(settings.camera_name(reason.camera)), reason.camera_u,
                        reason.camera_v, to_string(text_of(reason.rule).gives), to_string(reason.rule),
                        reason.guard ? to_string(*reason.guard) : "");
  }
  return text;
}

/// Writes the scans of one setup as a recording.
class RecordingPart {
 public:
  RecordingPart(TarWriter& archive, std::string name, const KeptSettings& settings)
      : archive_(archive), name_(std::move(name)), settings_(settings) {
    const PatternOptions& pattern = settings.pattern.options;
    about_ = {{"version", SLSD_VERSION},
              {"projector", {{"width_px", pattern.projector_width_px}, {"height_px", pattern.projector_height_px}}},
              {"cameras", json::array()},
              {"configuration", {{"decode", decode_keys(settings.decode)}, {"cloud", cloud_keys(settings.cloud)}}}};
    if (settings.hand_eye) about_["hand_eye_file"] = write_hand_eye(*settings.hand_eye);
    for (const std::string& camera : settings.camera_names) about_["cameras"].push_back({{"name", camera}});
    cameras_ = recorded_cameras(about_);
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
      about_["cameras"][i]["folder"] = cameras_[i].folder;
      about_["cameras"][i]["format"] = settings.camera_formats[i];
    }
  }

  [[nodiscard]] Result<> add(const KeptScan& scan) {
    json line = described(scan);
    if (scan.times > 1) line["times"] = scan.times;
    if (scan.too_large) line["frames_left_out"] = "the frames of one scan exceed [black_box] memory_max_mb";
    if (scan.frames) {
      line["density"] = to_string(scan.density);
      if (scan.part != CloudOptions{}) line["part"] = part_json(scan);
      for (const FrameImage& image : *scan.frames) {
        auto frame = put_frame(image);
        if (!frame) return tl::unexpected(frame.error());
        line["frames"].push_back(std::move(*frame));
      }
      if (scan.outcome && *scan.outcome) {
        line["full_levels"] = scan.outcome->value().full_levels;
        line["cloud"] = "clouds/" + numbered(framed_, ".ply");
        put(line["cloud"], write_ply(scan.outcome->value().cloud));
        line["reasons"] = "reasons/" + numbered(framed_, ".csv");
        put(line["reasons"], reasons_csv(scan.outcome->value(), settings_));
      }
      ++framed_;
    }
    (scan.outcome && *scan.outcome ? scans_ : failed_) += scan.times;
    lines_ += to_line(line);
    return {};
  }

  [[nodiscard]] Result<> finish() {
    about_["scans"] = scans_, about_["failed"] = failed_;
    put("slsd.toml", replay_configuration(about_, cameras_));
    put("pattern.toml", write_pattern(settings_.pattern));
    put("calibration.yml", settings_.calibration ? write_calibration(*settings_.calibration) : std::string());
    if (settings_.hand_eye) put("hand_eye.yml", about_["hand_eye_file"].get_ref<const std::string&>());
    about_.erase("hand_eye_file");
    put("scans.jsonl", lines_);
    put("recording.json", about_.dump(2) + "\n");
    if (!long_name_.empty())
      return fail(ErrorCode::kImpossible, "a camera's name is too long for a bundle", long_name_);
    return {};
  }

 private:
  [[nodiscard]] static json described(const KeptScan& scan) {
    json line{{"scan", scan.id}, {"time", utc_text_ms(scan.time)}};
    if (!scan.outcome) {
      line["error"] = rpc_error({ErrorCode::kCancelled, "the scan was still being decoded", {}}).to_json();
    } else if (const Result<ScanResult>& outcome = *scan.outcome; outcome) {
      line = scan_json(*outcome);
    } else {
      line["error"] = rpc_error(outcome.error()).to_json();
    }
    return line;
  }

  [[nodiscard]] static json part_json(const KeptScan& scan) {
    json part = cloud_keys(scan.part);
    add_frame(part, scan.base_from_rig ? &*scan.base_from_rig : nullptr);
    return part;
  }

  [[nodiscard]] Result<json> put_frame(const FrameImage& image) {
    const auto png = encode_png(view_of(image));
    if (!png) return tl::unexpected(png.error());
    json frame = frame_json(image);
    frame["light"] = light_name(image.light);
    const std::string below = image.light == Picture::kPattern ? "" : std::string(light_name(image.light)) + "/";
    for (const RecordedCamera& camera : cameras_) {
      if (camera.name == image.camera) frame["file"] = camera.folder + "/" + below + numbered(framed_, ".png");
    }
    put(frame.value("file", ""), *png);
    return frame;
  }

  void put(const std::string& file, std::string_view bytes) {
    const std::string name = name_ + "/" + file;
    plain_tar_name(name) ? archive_.add(name, bytes) : void(long_name_ = name);
  }

  TarWriter& archive_;
  std::string name_;
  const KeptSettings& settings_;
  std::vector<RecordedCamera> cameras_;
  json about_;
  std::string lines_;
  std::string long_name_;
  std::uint64_t scans_ = 0, failed_ = 0, framed_ = 0;
};

}  // namespace

Result<std::string> write_bundle(const std::vector<KeptScan>& scans, const BundleNotes& notes,
                                 std::chrono::system_clock::time_point now) {
  TarWriter archive(now);
  archive.add("bundle.json", json{{"format", "slsd bundle"},
                                  {"version", kBundleVersion},
                                  {"slsd", SLSD_VERSION},
                                  {"written", utc_text(now)},
                                  {"reason", notes.reason}}
                                     .dump(2) +
                                 "\n");
  archive.add("status.json", notes.status.dump(2, ' ', false, json::error_handler_t::replace) + "\n");
  archive.add("settings.json", notes.settings.dump(2, ' ', false, json::error_handler_t::replace) + "\n");
  archive.add("metrics.txt", notes.metrics);
  int recordings = 0;
  for (auto scan = scans.begin(); scan != scans.end();) {
    RecordingPart part(archive, "recording-" + std::to_string(++recordings), *scan->settings);
    const KeptSettings* const settings = scan->settings.get();
    for (; scan != scans.end() && scan->settings.get() == settings; ++scan) {
      if (auto added = part.add(*scan); !added) return tl::unexpected(added.error());
    }
    if (auto finished = part.finish(); !finished) return tl::unexpected(finished.error());
  }
  return std::move(archive).finish();
}

}  // namespace slsd
