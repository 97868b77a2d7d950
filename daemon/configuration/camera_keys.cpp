// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/configuration/camera_keys.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <utility>

namespace slsd {
namespace {

using std::filesystem::path;
using namespace std::string_view_literals;

constexpr std::array kTriggers{
    std::pair("software"sv, AravisTrigger::kSoftware), std::pair("line"sv, AravisTrigger::kLine),
    std::pair("free_run"sv, AravisTrigger::kFreeRun), std::pair("action"sv, AravisTrigger::kAction)};

constexpr std::array kClocks{std::pair("auto"sv, AravisClock::kAuto), std::pair("device"sv, AravisClock::kDevice),
                             std::pair("arrival"sv, AravisClock::kArrival)};

constexpr std::array kMosaics{std::pair("none"sv, BayerPattern::kNone), std::pair("RGGB"sv, BayerPattern::kRggb),
                              std::pair("BGGR"sv, BayerPattern::kBggr), std::pair("GRBG"sv, BayerPattern::kGrbg),
                              std::pair("GBRG"sv, BayerPattern::kGbrg)};

constexpr std::array kUses{std::pair("points"sv, CameraUse::kPoints), std::pair("texture"sv, CameraUse::kTexture)};

using OfDriver = decltype(CameraOptions::of_driver);

/// The drivers, each with its defaults.
std::array<std::pair<std::string_view, OfDriver>, std::variant_size_v<OfDriver>> drivers() {
  return {{{FileCameraOptions::kDriver, FileCameraOptions{}},
           {V4l2CameraOptions::kDriver, V4l2CameraOptions{}},
           {AravisCameraOptions::kDriver, AravisCameraOptions{}}}};
}

void read_keys(TableReader& reader, FileCameraOptions& options) {
  reader.read("path", options.path);
  reader.read("loop", options.loop);
  reader.read("rate_hz", options.rate_hz);
  reader.read_both("width_px", "height_px", options.size_px);
  reader.choose("bayer", options.bayer, kMosaics);
}

void read_keys(TableReader& reader, V4l2CameraOptions& options) {
  std::string device = options.device.string();
  reader.read("device", device);  // not as a path: a bare name is one of /dev/v4l/by-id
  options.device = device;
  reader.read("format", options.format);
  reader.read_both("width_px", "height_px", options.size_px);
  reader.read("frame_rate_hz", options.frame_rate_hz);
  reader.read("exposure_us", options.exposure_us);
  reader.read("gain_db", options.gain_db);
  reader.read("gain_steps", options.gain_steps);
  reader.read("focus_steps", options.focus_steps);
  reader.read("power_line_hz", options.power_line_hz);
  reader.read("automatic", options.automatic);
  reader.read("readout_us", options.readout_us);
  reader.read("settle_frames", options.settle_frames);
  reader.read("frames_held_max", options.frames_held_max);
  reader.read("missed_frames_max", options.missed_frames_max);
}

void read_keys(TableReader& reader, AravisCameraOptions& options) {
  reader.read("id", options.id);
  reader.read("interface", options.interface);
  reader.choose("trigger", options.trigger, kTriggers);
  reader.read("trigger_line", options.trigger_line);
  reader.read("action_device_key", options.action.device_key);
  reader.read("action_group_key", options.action.group_key);
  reader.read("action_group_mask", options.action.group_mask);
  reader.read("action_lead_us", options.action_lead_us);
  reader.read("ptp", options.ptp);
  reader.read("rate_hz", options.rate_hz);
  reader.choose("device_clock", options.device_clock, kClocks);
  reader.read("readout_us", options.readout_us);
  reader.read("exposure_us", options.exposure_us);
  reader.read("gain_db", options.gain_db);
  reader.read("pixel_format", options.pixel_format);
  reader.read_both("width_px", "height_px", options.size_px);
  reader.read("chunks", options.chunks);
  reader.read("packet_bytes", options.packet_bytes);
  reader.read("packet_delay_us", options.packet_delay_us);
  reader.read("receive_buffer_bytes", options.receive_buffer_bytes);
  reader.read("packet_resend", options.packet_resend);
  reader.read("packet_socket", options.packet_socket);
  reader.read("frame_timeout_ms", options.frame_timeout_ms);
  reader.read("missed_frames_max", options.missed_frames_max);
  reader.read("frames_held_max", options.frames_held_max);
}

void read_driver_keys(TableReader& reader, OfDriver& of_driver) {
  std::visit([&](auto& options) { read_keys(reader, options); }, of_driver);
}

void read_faults(TableReader& reader, CameraOptions& options) {
  std::vector<std::string> texts;
  reader.read("faults", texts);
  if (auto faults = parse_faults(texts)) {
    options.faults = std::move(*faults);
  } else {
    reader.refuse("faults", "has an invalid fault: " + faults.error().message);
  }
}

void read_exposures(TableReader& reader, CameraOptions& options) {
  std::vector<double> exposures_us;
  reader.read("exposures_us", exposures_us);
  if (!reader.has("exposures_us")) return;
  if (exposures_us.empty()) reader.refuse("exposures_us", "must be two exposures, as in [2000, 8000]");
  if (reader.has("exposure_us")) reader.refuse("exposures_us", "and exposure_us both set the exposure: leave one out");
  options.set_exposures(std::move(exposures_us));
}

void read_white_balance(TableReader& reader, CameraOptions& options) {
  std::vector<double> gains(options.white_balance.begin(), options.white_balance.end());
  reader.read("white_balance", gains);
  if (gains.size() == options.white_balance.size())
    std::ranges::copy(gains, options.white_balance.begin());
  else
    reader.refuse("white_balance", "must be three factors, of red, green and blue, as in [1.6, 1, 1.9]");
}

void refuse_keys_of_others(TableReader& reader, const toml::table& table, std::string_view driver) {
  const std::vector<std::string> own = reader.known();
  for (auto& [name, ignored] : drivers()) {
    TableReader others(&table, "", "");
    read_driver_keys(others, ignored);
    for (const std::string& key : others.known()) {
      if (!table.contains(key) || std::ranges::find(own, key) != own.end()) continue;
      reader.refuse(key, "is a key of the driver \"" + std::string(name) + "\", not of \"" + std::string(driver) +
                             "\": remove it");
    }
  }
}

void read_keys(TableReader& reader, CameraOptions& options) {
  std::string name = options.name();
  reader.read("name", name);
  const auto of_drivers = drivers();
  reader.choose("driver", options.of_driver, of_drivers);
  std::visit([&](auto& of_driver) { of_driver.name = name; }, options.of_driver);
  read_driver_keys(reader, options.of_driver);
  reader.choose("use", options.use, kUses);
  read_exposures(reader, options);
  read_white_balance(reader, options);
  read_faults(reader, options);
}

Result<CameraOptions> read_camera(const toml::table& table, const path& file) {
  TableReader reader(&table, "[[camera]]", file);
  CameraOptions options;
  read_keys(reader, options);
  refuse_keys_of_others(reader, table, options.driver());
  if (auto read = reader.finish(options.validate()); !read) return tl::unexpected(read.error());
  return options;
}

}  // namespace

Result<std::vector<CameraOptions>> read_cameras(const std::vector<const toml::table*>& tables, const path& file) {
  std::vector<CameraOptions> cameras;
  for (const toml::table* table : tables) {
    auto camera = read_camera(*table, file);
    if (!camera) return tl::unexpected(camera.error());
    const auto same = [&](const CameraOptions& other) { return other.name() == camera->name(); };
    if (std::ranges::any_of(cameras, same)) {
      return fail(ErrorCode::kInvalidArgument,
                  "[[camera]] name \"" + camera->name() + "\" is used twice: give each camera its own name",
                  place_of(table->contains("name") ? table->get("name")->source() : table->source(), file.string()));
    }
    cameras.push_back(std::move(*camera));
  }
  if (!cameras.empty() && std::ranges::none_of(cameras, &CameraOptions::measures)) {
    return fail(ErrorCode::kInvalidArgument,
                "[[camera]] use = \"texture\" only gives colours to the points of another camera: add a camera that "
                "measures, or remove the key",
                place_of(tables.front()->get("use")->source(), file.string()));
  }
  std::stable_partition(cameras.begin(), cameras.end(), [](const CameraOptions& camera) { return camera.measures(); });
  return cameras;
}

std::vector<std::string> known_camera_keys() {
  std::vector<std::string> keys;
  for (const auto& [driver, of_driver] : drivers()) {
    TableReader reader(nullptr, "", "");
    CameraOptions ignored{of_driver, {}, {}};
    read_keys(reader, ignored);
    for (const std::string& key : reader.known()) keys.push_back("camera." + std::string(driver) + "." + key);
  }
  return keys;
}

}  // namespace slsd
