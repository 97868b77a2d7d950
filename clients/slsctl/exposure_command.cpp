// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <iostream>
#include <optional>

#include <fmt/format.h>

#include "clients/connection/connection.hpp"
#include "clients/slsctl/client_commands.hpp"
#include "clients/slsctl/report.hpp"
#include "core/exposure/exposure_advice.hpp"
#include "core/printable.hpp"
#include "daemon/rpc/message.hpp"

namespace slsd {
namespace {

using nlohmann::json;

/// The inspected camera, and the result.
struct Look {
  json camera;
  std::optional<ExposureSetting> present;
  LightLevels levels;
  FrameChange change;
  ExposureAdvice advice;
};

tl::expected<Answered, Failure> ask_for_frame(Connection& connection, const ClientOptions& options) {
  json params{{"format", "raw"}, {"camera", options.camera}};
  if (options.timeout_ms) params["timeout_ms"] = *options.timeout_ms;
  return ask(connection, "frame", params);
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

tl::expected<Look, Failure> look(const ClientOptions& options) {
  auto connection = Connection::open(options.socket);
  if (!connection) return tl::unexpected(failure(connection.error()));
  const auto settings = ask(*connection, "settings", json::object());
  if (!settings) return tl::unexpected(settings.error());
  const auto first = ask_for_frame(*connection, options);
  if (!first) return tl::unexpected(first.error());
  const auto second = ask_for_frame(*connection, options);
  if (!second) return tl::unexpected(second.error());
  const auto frame = first->reply.image(first->reply.message["result"]);
  const auto next = second->reply.image(second->reply.message["result"]);
  if (!frame || !next) return tl::unexpected(failure((frame ? next : frame).error()));
  const json& told = settings->reply.message["result"];
  Look look;
  look.camera = camera_named(told, options.camera);
  look.present = present_setting(look.camera);
  look.levels = measure_light(*frame, full_level(look.camera.value("format", ""), *frame));
  look.change = compare_frames(*frame, *next);
  look.advice = advise_exposure(look.levels, look.change, look.present, limits_of(told, options));
  return look;
}

json setting_json(const std::optional<ExposureSetting>& setting) {
  if (!setting) return nullptr;
  return {{"exposure_us", setting->exposure_us}, {"gain_db", setting->gain_db}};
}

json to_json(const Look& look) {
  json troubles = json::array();
  for (const Trouble trouble : look.advice.troubles) {
    troubles.push_back({{"name", to_string(trouble)}, {"remedy", remedy(trouble)}});
  }
  return {{"camera", look.camera.value("name", "")},
          {"full", look.levels.full},
          {"lit", look.levels.lit},
          {"lit_brightest", look.levels.lit_brightest},
          {"lit_faintest", look.levels.lit_faintest},
          {"dark", look.levels.dark},
          {"clipped_share", look.levels.clipped_share},
          {"patterned_share", look.levels.patterned_share},
          {"edge_px", look.levels.edge_px},
          {"period_px", look.levels.period_px},
          {"noise", look.change.noise},
          {"moved_share", look.change.moved_share},
          {"flicker", look.change.flicker()},
          {"brighter", look.advice.brighter},
          {"look_again", look.advice.look_again},
          {"present", setting_json(look.present)},
          {"proposed", setting_json(look.advice.setting)},
          {"troubles", std::move(troubles)}};
}

std::string proposal(const Look& look) {
  const ExposureAdvice& advice = look.advice;
  if (look.levels.patterned_share == 0) return "";
  std::string text = advice.brighter == 1
                         ? "brightness: good as it is\n"
                         : fmt::format("brightness: {:.2g} times as much light would be best\n", advice.brighter);
  if (advice.setting) {
    text +=
        fmt::format("set exposure_us = {:.0f}, gain {:.1f} dB; now {:.0f} and {:.1f} dB\n", advice.setting->exposure_us,
                    advice.setting->gain_db, look.present->exposure_us, look.present->gain_db);
  }
  return text + (advice.look_again
                     ? "symbols are clipped, by an unknown amount: set this, and run slsctl exposure again\n"
                     : "");
}

std::string text_of(const Look& look) {
  const LightLevels& levels = look.levels;
  std::string text = fmt::format(
      "camera \"{}\": symbols {:.0f} of {:.0f} (brightest {:.0f}, faintest {:.0f}), between them {:.0f}, noise {:.1f}\n"
      "pattern on {:.0f} % of the frame, clipped on {:.0f} % of that; edges {:.1f} px wide, every {:.0f} px\n",
      printable(look.camera.value("name", "")), levels.lit, levels.full, levels.lit_brightest, levels.lit_faintest,
      levels.dark, look.change.noise, 100 * levels.patterned_share, 100 * levels.clipped_share, levels.edge_px,
      levels.period_px);
  text += proposal(look);
  for (const Trouble trouble : look.advice.troubles)
    text += fmt::format("{}: {}\n", to_string(trouble), remedy(trouble));
  return text;
}

}  // namespace

tl::expected<json, Failure> look_at_exposure(const ClientOptions& options) {
  const auto seen = look(options);
  if (!seen) return tl::unexpected(seen.error());
  return to_json(*seen);
}

int exposure_command(const ClientOptions& options) {
  const auto seen = look(options);
  if (!seen) return report(options, seen.error());
  std::cout << (options.json ? to_line(to_json(*seen)) : text_of(*seen));
  return kDone;
}

}  // namespace slsd
