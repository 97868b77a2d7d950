// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/slsctl/look_at_light.hpp"

#include <utility>

#include <fmt/format.h>

#include "clients/connection/connection.hpp"
#include "core/cloud/ply.hpp"
#include "core/image_size.hpp"
#include "drivers/files/read_image.hpp"
#include "rpc/message.hpp"

namespace slsd {
namespace {

using nlohmann::json;

tl::expected<GreyImage, Failure> take_frame(Connection& connection, const ClientOptions& options) {
  json params{{"format", "raw"}};
  if (!options.camera.empty()) params["camera"] = options.camera;
  if (options.timeout_ms) params["timeout_ms"] = *options.timeout_ms;
  const auto answered = ask(connection, "frame", params);
  if (!answered) return tl::unexpected(answered.error());
  const auto frame = answered->reply.image(answered->reply.message["result"]);
  if (!frame) return tl::unexpected(failure(frame.error()));
  return copy_of(*frame);
}

// Without a name, the first camera, as in the daemon.
json camera_named(const json& settings, const std::string& name) {
  for (const json& camera : settings.value("cameras", json::array())) {
    if (name.empty() || camera.value("name", "") == name) return camera;
  }
  return json::object();
}

std::optional<ExposureSetting> present_setting(const json& camera) {
  if (!camera.contains("exposure_us")) return std::nullopt;
  return ExposureSetting{camera.value("exposure_us", 0.0), camera.value("gain_db", 0.0)};
}

ExposureLimits limits_of(const json& settings, const ClientOptions& options) {
  ExposureLimits limits;
  limits.periods.refresh_hz = settings.value("projector", json::object()).value("refresh_hz", 60.0);
  limits.periods.power_line_hz = settings.value("power_line_hz", 0.0);
  limits.exposure_max_us = options.exposure_max_us.value_or(limits.exposure_max_us);
  limits.gain_max_db = options.gain_max_db.value_or(limits.gain_max_db);
  return limits;
}

// Cameras have the configuration's order in a cloud.
int number_of(const json& settings, const std::string& name) {
  int number = 0;
  for (const json& camera : settings.value("cameras", json::array())) {
    if (name.empty() || camera.value("name", "") == name) break;
    ++number;
  }
  return number;
}

std::optional<PatternPitch> scan_pitch(Connection& connection, const json& settings, const ClientOptions& options) {
  json params{{"format", "ply"}, {"density", "symbols"}, {"coordinate_frame", "rig"}};
  if (options.timeout_ms) params["timeout_ms"] = *options.timeout_ms;
  const auto answered = ask(connection, "scan", params);
  if (!answered) return std::nullopt;
  const auto cloud = read_ply(answered->reply.bytes, "the service's cloud");
  if (!cloud) return std::nullopt;
  const int camera = number_of(settings, options.camera);
  std::vector<SymbolPlace> symbols;
  for (const CloudPoint& point : cloud->points) {
    if (point.camera == camera) symbols.push_back({point.column, point.row, point.camera_u});
  }
  return measure_pitch(symbols);
}

tl::expected<SeenLight, Failure> ask_service(const ClientOptions& options, LookAtPitch pitch) {
  auto connection = Connection::open(options.socket);
  if (!connection) return tl::unexpected(failure(connection.error()));
  const auto settings = ask(*connection, "settings", json::object());
  if (!settings) return tl::unexpected(settings.error());
  auto first = take_frame(*connection, options);
  if (!first) return tl::unexpected(first.error());
  const auto second = take_frame(*connection, options);
  if (!second) return tl::unexpected(second.error());
  const json& told = settings->reply.message["result"];
  const json camera = camera_named(told, options.camera);
  SeenLight seen;
  seen.camera = camera.value("name", "");
  seen.frame = std::move(*first);
  seen.present = present_setting(camera);
  const GreyView frame = view(seen.frame);
  seen.light = measure_frame_light(frame, view(*second), full_level(camera.value("format", ""), frame));
  seen.light.exposure_is_configured = seen.present || camera.value("driver", "") == "file";
  if (pitch == LookAtPitch::kYes) seen.light.pitch = scan_pitch(*connection, told, options);
  seen.advice = advise_exposure(seen.light, seen.present, limits_of(told, options));
  return seen;
}

tl::expected<SeenLight, Failure> read_files(const ClientOptions& options) {
  std::vector<GreyImage> frames;
  for (const auto& file : options.from) {
    auto frame = read_image(file);
    if (!frame) return tl::unexpected(Failure{kRequestFailed, rpc_error(frame.error())});
    frames.push_back(std::move(*frame));
  }
  const GreyView first = view(frames.front()), last = view(frames.back());
  if (size_of(first) != size_of(last) || first.index() != last.index()) {
    return tl::unexpected(
        failure({ErrorCode::kMismatch,
                 fmt::format("it has {} pixels of {} bits, the other {} of {}: give two frames of one "
                             "camera in one mode",
                             size_text(size_of(last).first, size_of(last).second), last.index() == 0 ? 8 : 16,
                             size_text(size_of(first).first, size_of(first).second), first.index() == 0 ? 8 : 16),
                 options.from.back().string()}));
  }
  SeenLight seen;
  seen.light = measure_frame_light(first, frames.size() > 1 ? std::optional(last) : std::nullopt,
                                   std::max(guess_full_level(first), guess_full_level(last)));
  seen.advice = advise_exposure(seen.light, std::nullopt, {});
  seen.frame = std::move(frames.front());
  return seen;
}

}  // namespace

tl::expected<SeenLight, Failure> look_at_light(const ClientOptions& options, LookAtPitch pitch) {
  return options.from.empty() ? ask_service(options, pitch) : read_files(options);
}

std::string troubles_text(const std::vector<Trouble>& troubles) {
  std::string text;
  for (const Trouble trouble : troubles) text += fmt::format("{}: {}\n", to_string(trouble), remedy(trouble));
  return text;
}

json troubles_json(const std::vector<Trouble>& troubles) {
  json list = json::array();
  for (const Trouble trouble : troubles) list.push_back({{"name", to_string(trouble)}, {"remedy", remedy(trouble)}});
  return list;
}

}  // namespace slsd
