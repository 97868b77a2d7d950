// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <limits>
#include <map>

#include "core/geometry/robot_pose.hpp"
#include "core/printable.hpp"
#include "daemon/bundle/bundle.hpp"
#include "rpc/request.hpp"

namespace slsd {
namespace {

using nlohmann::json;

constexpr std::size_t kTextBytesMax = 16 << 20;  // limit of a pattern or a calibration
constexpr std::size_t kLineBytesMax = 64 << 10;

tl::unexpected<Error> fail_part(std::string message, std::string file) {
  return fail(ErrorCode::kMalformed, std::move(message), std::move(file));
}

// Reads an object of limited length, depth and number of values.
Result<json> object_in(std::string_view text, const std::string& file) {
  if (text.size() > kLineBytesMax) return fail_part("is too long for the description of a scan", file);
  const JsonShape shape = shape_of(text);
  const bool plain = shape.closed && shape.depth <= kMaxNesting && shape.values <= kMaxValues;
  json object = plain ? json::parse(text, nullptr, /*allow_exceptions=*/false) : json();
  if (!object.is_object()) return fail_part("is not a JSON object", file);
  return object;
}

// A member if it has the right type, else the default.
template <class T>
T member(const json& object, const char* name, bool (json::*of_type)() const noexcept, T otherwise) {
  const auto found = object.find(name);
  return found != object.end() && ((*found).*of_type)() ? found->get<T>() : otherwise;
}

std::string text_of(const json& object, const char* name) {
  return member<std::string>(object, name, &json::is_string, {});
}

/// Reads numbers that write_bundle() wrote. @return nothing if one is no number
std::optional<std::vector<double>> numbers_in(const json& object, const char* name) {
  std::vector<double> numbers;
  for (const json& number : member<json>(object, name, &json::is_array, json::array())) {
    if (!number.is_number()) return std::nullopt;
    numbers.push_back(number.get<double>());
  }
  return numbers;
}

/// Reads the part of the scene that a scan's cloud shows; everything if the line names none.
Result<> read_part(const json& line, const std::string& where, BundledScan& scan) {
  const auto told = line.find("part");
  if (told == line.end()) return {};
  if (!told->is_object()) return fail_part("part must be an object", where);
  const auto box = numbers_in(*told, "box"), plane = numbers_in(*told, "plane"),
             base_from_rig = numbers_in(*told, "base_from_rig");
  if (!box || !plane || !base_from_rig) return fail_part("part must have lists of numbers", where);
  const auto stride = member<std::int64_t>(*told, "stride", &json::is_number_integer, 1);
  scan.part = {*box, *plane,
               text_of(*told, "box_frame") == "robot_base" ? CoordinateFrame::kRobotBase : CoordinateFrame::kRig,
               member<double>(*told, "voxel_mm", &json::is_number, 0),
               static_cast<int>(std::clamp<std::int64_t>(stride, 0, std::numeric_limits<int>::max()))};
  if (auto valid = scan.part.validate(); !valid)
    return fail_part("part: " + valid.error().where + " " + valid.error().message, where);
  if (base_from_rig->empty()) return {};
  const auto place = read_robot_pose(*base_from_rig, {TurnNumbers::kMatrix, /*unit_mm=*/1, /*unit_rad=*/1});
  if (!place) return fail_part("base_from_rig " + place.error().message, where);
  scan.base_from_rig.emplace();
  for (Eigen::Index row = 0; row < 3; ++row) {  // to the last bit, as the service had it
    const double* const four = base_from_rig->data() + 4 * row;
    scan.base_from_rig->rotation.row(row) = Eigen::RowVector3d(four[0], four[1], four[2]);
    scan.base_from_rig->translation[row] = four[3];
  }
  return {};
}

class Reader {
 public:
  explicit Reader(std::vector<TarFile> files) {
    for (const TarFile& file : files) by_name_[file.name] = file.bytes;
    bundle_.files = std::move(files);
  }

  [[nodiscard]] Result<Bundle> read() && {
    if (bundle_.files.empty() || bundle_.files.front().name != "bundle.json")
      return fail(ErrorCode::kMalformed, "is a tar archive but not a bundle: it does not begin with bundle.json");
    auto about = object_in(bundle_.files.front().bytes, "bundle.json");
    if (!about) return tl::unexpected(about.error());
    if (text_of(*about, "format") != "slsd bundle")
      return fail(ErrorCode::kMalformed, "is not a bundle of slsd", "bundle.json");
    bundle_.version = printable(text_of(*about, "slsd"), 40);
    const auto version = member<std::int64_t>(*about, "version", &json::is_number_integer, -1);
    if (version != kBundleVersion) {
      return fail(ErrorCode::kUnsupported,
                  "has version " + std::to_string(version) + ", but this slsd reads version " +
                      std::to_string(kBundleVersion) + ": replay it with slsd " + bundle_.version,
                  "bundle.json");
    }
    bundle_.written = printable(text_of(*about, "written"), 40);
    if (const auto reason = about->find("reason"); reason != about->end() && reason->is_object()) {
      const json error = member<json>(*reason, "error", &json::is_object, json::object());
      bundle_.reason =
          "scan " + printable(text_of(*reason, "scan"), 40) + " failed: " + printable(text_of(error, "message"), 1000);
    }
    for (const TarFile& file : bundle_.files) {
      const std::size_t slash = file.name.find('/');
      if (slash == std::string::npos || file.name.substr(slash) != "/recording.json") continue;
      if (auto added = add_recording(file.name.substr(0, slash)); !added) return tl::unexpected(added.error());
    }
    return std::move(bundle_);
  }

 private:
  [[nodiscard]] Result<std::string_view> file_of(const std::string& name) const {
    const auto found = by_name_.find(name);
    if (found == by_name_.end()) return fail_part("is missing from the bundle", printable(name));
    return found->second;
  }

  [[nodiscard]] Result<> add_recording(const std::string& name) {
    BundledRecording recording;
    recording.name = name;
    for (auto [file, text] :
         {std::pair("/slsd.toml", &recording.configuration), std::pair("/pattern.toml", &recording.pattern),
          std::pair("/calibration.yml", &recording.calibration)}) {
      const auto bytes = file_of(name + file);
      if (!bytes) return tl::unexpected(bytes.error());
      if (bytes->size() > kTextBytesMax) return fail_part("is too long", name + file);
      *text = *bytes;
    }
    auto lines = file_of(name + "/scans.jsonl");
    if (!lines) return tl::unexpected(lines.error());
    while (!lines->empty()) {
      const std::size_t end = std::min(lines->find('\n'), lines->size());
      auto scan = scan_in(lines->substr(0, end), name);
      if (!scan) return tl::unexpected(scan.error());
      if (recording.scans.size() == kTarFilesMax) return fail_part("has too many scans", name + "/scans.jsonl");
      recording.scans.push_back(std::move(*scan));
      lines->remove_prefix(std::min(end + 1, lines->size()));
    }
    bundle_.recordings.push_back(std::move(recording));
    return {};
  }

  [[nodiscard]] Result<BundledScan> scan_in(std::string_view text, const std::string& recording) const {
    const std::string where = recording + "/scans.jsonl";
    const auto line = object_in(text, where);
    if (!line) return tl::unexpected(line.error());
    BundledScan scan;
    scan.id = printable(text_of(*line, "scan"), 64);
    scan.time = printable(text_of(*line, "time"), 64);
    scan.error = printable(
        text_of(member<json>(*line, "error", &json::is_object, json::object()).value("data", json::object()), "name"),
        64);
    scan.dense = text_of(*line, "density") == to_string(Density::kPixels);
    if (auto read = read_part(*line, where, scan); !read) return tl::unexpected(read.error());
    for (const json& level : member<json>(*line, "full_levels", &json::is_array, json::array())) {
      if (!level.is_number()) return fail_part("full_levels must hold only numbers", where);
      scan.full_levels.push_back(level.get<double>());
    }
    for (const json& told : member<json>(*line, "frames", &json::is_array, json::array())) {
      if (!told.is_object()) return fail_part("frames must hold only objects", where);
      BundledFrame frame{text_of(told, "camera"),
                         text_of(told, "light"),
                         {},
                         member<std::uint64_t>(told, "frame", &json::is_number_unsigned, 0)};
      const auto png = file_of(recording + "/" + text_of(told, "file"));
      if (!png) return tl::unexpected(png.error());
      frame.png = *png;
      scan.frames.push_back(std::move(frame));
    }
    if (line->contains("cloud")) {
      const auto cloud = file_of(recording + "/" + text_of(*line, "cloud"));
      if (!cloud) return tl::unexpected(cloud.error());
      scan.cloud = *cloud;
    }
    return scan;
  }

  Bundle bundle_;
  std::map<std::string, std::string_view> by_name_;
};

}  // namespace

Result<Bundle> read_bundle(std::string_view archive) {
  auto files = read_tar(archive);
  if (!files) return tl::unexpected(files.error());
  return Reader(std::move(*files)).read();
}

}  // namespace slsd
