// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/configuration/configuration.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "core/toml/table_reader.hpp"
#include "daemon/configuration/camera_keys.hpp"
#include "drivers/files/file.hpp"

namespace slsd {
namespace {

using nlohmann::json;
using std::filesystem::path;
using namespace std::string_view_literals;

constexpr std::size_t kMaxFileBytes = 1 << 20;

constexpr std::array kProjectorDrivers{std::pair("headless"sv, ProjectorDriver::kHeadless),
                                       std::pair("glfw"sv, ProjectorDriver::kGlfw)};
constexpr auto kIdlePictures = std::span(kPictureNames).first(3);  // pattern, white and black
constexpr std::array kArrayMethods{std::pair("constructive"sv, ArrayMethod::kConstructive),
                                   std::pair("no_repeats"sv, ArrayMethod::kNoRepeats),
                                   std::pair("paper"sv, ArrayMethod::kPaper)};
constexpr std::array kPrecisions{std::pair("standard"sv, Precision::kStandard), std::pair("fine"sv, Precision::kFine)};
constexpr std::array kDensities{std::pair("symbols"sv, Density::kSymbols), std::pair("pixels"sv, Density::kPixels)};
constexpr std::array kMethods{std::pair("default"sv, Method::kDefault), std::pair("paper"sv, Method::kPaper)};
constexpr std::array kCoordinateFrames{std::pair("rig"sv, CoordinateFrame::kRig),
                                       std::pair("robot_base"sv, CoordinateFrame::kRobotBase)};
constexpr std::array kOtherHardware{std::pair("error"sv, OtherHardware::kError),
                                    std::pair("warn"sv, OtherHardware::kWarn)};

/// Takes the place of a TableReader and notes the values in force.
class KeyWriter {
 public:
  template <class Value>
  void read(const char* key, const Value& value) {
    keys_[key] = value;
  }
  template <class Value, class Choices>
  void choose(const char* key, const Value& value, const Choices& choices) {
    for (const auto& [name, choice] : choices)
      if (choice == value) keys_[key] = name;
  }
  [[nodiscard]] json keys() && { return std::move(keys_); }

 private:
  json keys_ = json::object();
};

void read_keys(TableReader& reader, ProjectorOptions& options) {
  reader.choose("driver", options.driver, kProjectorDrivers);
  reader.read("monitor", options.monitor);
  reader.read("width_px", options.width_px);
  reader.read("height_px", options.height_px);
  reader.read("enable_output", options.enable_output);
  reader.read("brightness", options.light.brightness);
  reader.read("gamma", options.light.gamma);
  reader.read("black_level", options.light.black_level);
  reader.read("refresh_hz", options.refresh_hz);
  reader.choose("idle", options.idle, kIdlePictures);
  reader.read("idle_after_ms", options.idle_after_ms);
}

void read_keys(TableReader& reader, PatternOptions& options) {
  reader.read("symbol_size_px", options.symbol_size_px);
  reader.read("spacing_px", options.spacing_px);
  reader.read("symbols", options.symbols);
  reader.read("seed", options.seed);
  reader.choose("method", options.method, kArrayMethods);
  reader.read("minimum_distance", options.minimum_distance);
  reader.read("half_turn_unique", options.half_turn_unique);
  reader.read("row_reach", options.row_reach);
  reader.read("column_reach", options.column_reach);
}

template <class Reader>
void read_keys(Reader& reader, DecodeOptions& options) {
  reader.read("depth_min_mm", options.depth_min_mm);
  reader.read("depth_max_mm", options.depth_max_mm);
  reader.read("wrong_cells_max", options.wrong_cells_max);
  reader.choose("precision", options.precision, kPrecisions);
  reader.choose("density", options.density, kDensities);
  reader.read("dense_stride_px", options.dense.stride_px);
  reader.read("dense_prune_px", options.dense.prune_px);
  reader.choose("binarize", options.binarize, kMethods);
  reader.choose("find_regions", options.find_regions, kMethods);
  reader.choose("classify", options.classify, kMethods);
  reader.choose("centre", options.centre, kMethods);
  reader.choose("link_grid", options.link_grid, kMethods);
  reader.choose("decode_windows", options.decode_windows, kMethods);
  reader.choose("correspond", options.correspond, kMethods);
}

void read_keys(TableReader& reader, FrameOptions& options) {
  reader.choose("output", options.output, kCoordinateFrames);
  reader.read("hand_eye", options.hand_eye);
}

template <class Reader>
void read_keys(Reader& reader, CloudOptions& options) {
  reader.read("box", options.box);
  reader.read("plane", options.plane);
  reader.choose("box_frame", options.box_frame, kCoordinateFrames);
  reader.read("voxel_mm", options.voxel_mm);
  reader.read("stride", options.stride);
}

void read_keys(TableReader& reader, ScanOptions& options) {
  reader.read("timeout_ms", options.timeout_ms);
  reader.read("exposure_skew_ms", options.exposure_skew_ms);
  reader.read("reopen_first_ms", options.reopen_first_ms);
  reader.read("reopen_longest_ms", options.reopen_longest_ms);
  reader.read("projector_latency_ms", options.projector_latency_ms);
  reader.read("power_line_hz", options.power_line_hz);
}

void read_keys(TableReader& reader, ServerOptions& options) {
  reader.read("socket", options.socket);
  reader.read("socket_mode", options.socket_mode);
  reader.read("observe", options.observe);
  reader.read("scan", options.scan);
  reader.read("administer", options.administer);
  reader.read("clients_max", options.clients_max);
  reader.read("request_bytes_max", options.request_bytes_max);
  reader.read("memory_max_mb", options.memory_max_mb);
  reader.read("send_timeout_ms", options.send_timeout_ms);
}

void read_keys(TableReader& reader, BlackBoxOptions& options) {
  reader.read("memory_max_mb", options.memory_max_mb);
  reader.read("disk_max_mb", options.disk_max_mb);
  reader.read("folder", options.folder);
}

template <class Options>
Result<> read_table(TableReader reader, Options& options) {
  read_keys(reader, options);
  return reader.finish(options.validate());
}

template <class Options>
json keys_in_force(Options& options) {
  KeyWriter writer;
  read_keys(writer, options);
  return std::move(writer).keys();
}

// A pattern file contains the whole pattern: another key beside it could only contradict it.
Result<> read_pattern_table(TableReader reader, Configuration& configuration) {
  PatternOptions& options = configuration.pattern;
  options.projector_width_px = configuration.projector.width_px;
  options.projector_height_px = configuration.projector.height_px;
  read_keys(reader, options);
  const std::vector<std::string> of_pattern = reader.known();
  reader.read("file", configuration.pattern_file);
  for (const std::string& key : of_pattern)
    if (!configuration.pattern_file.empty() && reader.has(key))
      reader.refuse(key, "cannot be combined with file, which holds the whole pattern: remove one");
  if (auto read = reader.finish(options.validate()); !read) return read;
  if (options.symbols.empty()) options.symbols = default_symbols(options.symbol_size_px);
  return {};
}

void read_calibration_keys(TableReader& reader, Configuration& configuration) {
  reader.read("file", configuration.calibration_file);
  reader.choose("other_hardware", configuration.other_hardware, kOtherHardware);
}

Result<> read_calibration_table(TableReader reader, Configuration& configuration) {
  read_calibration_keys(reader, configuration);
  return reader.finish();
}

// The keys as given, by table. Dates and times, which no key uses, become null.
json given_keys(const toml::node& node);

json keys_of(const toml::table& table) {
  json keys = json::object();
  for (const auto& [key, value] : table) keys[std::string(key.str())] = given_keys(value);
  return keys;
}

json values_of(const toml::array& array) {
  json values = json::array();
  for (const toml::node& value : array) values.push_back(given_keys(value));
  return values;
}

json given_keys(const toml::node& node) {
  if (const auto* table = node.as_table()) return keys_of(*table);
  if (const auto* array = node.as_array()) return values_of(*array);
  if (const auto* text = node.as_string()) return text->get();
  if (const auto* number = node.as_integer()) return number->get();
  if (const auto* number = node.as_floating_point()) return number->get();
  if (const auto* flag = node.as_boolean()) return flag->get();
  return nullptr;
}

Result<Configuration> read_tables(const toml::table& document, const path& file) {
  TableReader top(&document, "", file);
  const auto table = [&](const std::string& name) { return TableReader(top.table(name), "[" + name + "]", file); };
  const TableReader projector = table("projector"), pattern = table("pattern"), calibration = table("calibration"),
                    decode = table("decode"), cloud = table("cloud"), frame = table("frame"), scan = table("scan"),
                    server = table("server"), black_box = table("black_box");
  const std::vector<const toml::table*> cameras = top.tables("camera");
  Configuration configuration;
  Result<> read = top.finish();
  if (read) read = read_table(projector, configuration.projector);
  if (read) read = read_pattern_table(pattern, configuration);
  if (read) {
    auto listed = read_cameras(cameras, file);
    if (!listed) return tl::unexpected(listed.error());
    configuration.cameras = std::move(*listed);
  }
  if (read) read = read_calibration_table(calibration, configuration);
  if (read) read = read_table(decode, configuration.decode);
  if (read) read = read_table(frame, configuration.frame);
  if (read) read = read_table(cloud, configuration.cloud);
  if (read) read = read_table(scan, configuration.scan);
  if (read) read = read_table(server, configuration.server);
  if (read) read = read_table(black_box, configuration.black_box);
  if (!read) return tl::unexpected(read.error());
  configuration.given = given_keys(document);
  return configuration;
}

}  // namespace

Result<Configuration> read_configuration(std::string_view text, const path& file) {
  try {
    return read_tables(toml::parse(text, file.string()), file);
  } catch (const toml::parse_error& error) {
    return fail(ErrorCode::kMalformed, std::string(error.description()), place_of(error.source(), file.string()));
  }
}

std::vector<std::string> known_keys() {
  std::vector<std::string> keys = known_camera_keys();
  Configuration ignored;
  const auto add = [&](const std::string& table, const auto& read) {
    TableReader reader(nullptr, "", "");
    read(reader);
    for (const std::string& key : reader.known()) keys.push_back(table + "." + key);
  };
  add("pattern", [&](auto& reader) { read_keys(reader, ignored.pattern), reader.read("file", ignored.pattern_file); });
  add("projector", [&](auto& reader) { read_keys(reader, ignored.projector); });
  add("calibration", [&](auto& reader) { read_calibration_keys(reader, ignored); });
  add("decode", [&](auto& reader) { read_keys(reader, ignored.decode); });
  add("frame", [&](auto& reader) { read_keys(reader, ignored.frame); });
  add("cloud", [&](auto& reader) { read_keys(reader, ignored.cloud); });
  add("scan", [&](auto& reader) { read_keys(reader, ignored.scan); });
  add("server", [&](auto& reader) { read_keys(reader, ignored.server); });
  add("black_box", [&](auto& reader) { read_keys(reader, ignored.black_box); });
  return keys;
}

json decode_keys(DecodeOptions options) {
  return keys_in_force(options);
}

json cloud_keys(CloudOptions options) {
  return keys_in_force(options);
}

Result<Configuration> load_configuration(const path& file) {
  auto text = read_file(file, kMaxFileBytes);
  if (!text) return tl::unexpected(text.error());
  return read_configuration(*text, file);
}

Result<Configuration> load_configuration_or_defaults(const std::optional<path>& file) {
  if (file) return load_configuration(*file);
  std::error_code ignored;
  if (std::filesystem::exists(kConfigurationFile, ignored)) return load_configuration(kConfigurationFile);
  return read_configuration("", "defaults");
}

}  // namespace slsd
