// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <iostream>
#include <optional>

#include <fmt/format.h>

#include "clients/slsctl/commands/client_commands.hpp"
#include "clients/slsctl/look_at_light.hpp"
#include "clients/slsctl/report.hpp"
#include "core/printable.hpp"

namespace slsd {
namespace {

using nlohmann::json;

json setting_json(const std::optional<ExposureSetting>& setting) {
  if (!setting) return nullptr;
  return {{"exposure_us", setting->exposure_us}, {"gain_db", setting->gain_db}};
}

json to_json(const SeenLight& seen) {
  const LightLevels& levels = seen.light.levels;
  const FrameChange change = seen.light.change.value_or(FrameChange{});
  return {{"camera", seen.camera},
          {"full", levels.full},
          {"lit", levels.lit},
          {"lit_brightest", levels.lit_brightest},
          {"lit_faintest", levels.lit_faintest},
          {"dark", levels.dark},
          {"clipped_share", levels.clipped_share},
          {"patterned_share", levels.patterned_share},
          {"edge_px", levels.edge_px},
          {"period_px", levels.period_px},
          {"noise", change.noise},
          {"moved_share", change.moved_share},
          {"flicker", change.flicker()},
          {"brighter", seen.advice.brighter},
          {"look_again", seen.advice.look_again},
          {"present", setting_json(seen.present)},
          {"proposed", setting_json(seen.advice.setting)},
          {"troubles", troubles_json(seen.advice.troubles)}};
}

std::string proposal(const SeenLight& seen) {
  const ExposureAdvice& advice = seen.advice;
  if (seen.light.levels.patterned_share == 0) return "";
  std::string text = advice.brighter == 1
                         ? "brightness: good as it is\n"
                         : fmt::format("brightness: {:.2g} times as much light would be best\n", advice.brighter);
  if (advice.setting) {
    text +=
        fmt::format("set exposure_us = {:.0f}, gain {:.1f} dB; now {:.0f} and {:.1f} dB\n", advice.setting->exposure_us,
                    advice.setting->gain_db, seen.present->exposure_us, seen.present->gain_db);
  }
  return text;
}

std::string text_of(const SeenLight& seen) {
  const LightLevels& levels = seen.light.levels;
  std::string text = fmt::format(
      "camera \"{}\": symbols {:.0f} of {:.0f} (brightest {:.0f}, faintest {:.0f}), between them {:.0f}, noise {:.1f}\n"
      "pattern on {:.0f} % of the frame, clipped on {:.0f} % of that; edges {:.1f} px wide, every {:.0f} px\n",
      printable(seen.camera), levels.lit, levels.full, levels.lit_brightest, levels.lit_faintest, levels.dark,
      seen.light.change->noise, 100 * levels.patterned_share, 100 * levels.clipped_share, levels.edge_px,
      levels.period_px);
  return text + proposal(seen) + troubles_text(seen.advice.troubles);
}

}  // namespace

tl::expected<json, Failure> look_at_exposure(const ClientOptions& options) {
  const auto seen = look_at_light(options, LookAtPitch::kNo);
  if (!seen) return tl::unexpected(seen.error());
  return to_json(*seen);
}

int exposure_command(const ClientOptions& options) {
  const auto seen = look_at_light(options, LookAtPitch::kNo);
  if (!seen) return report(options, seen.error());
  std::cout << (options.json ? to_line(to_json(*seen)) : text_of(*seen));
  return kDone;
}

}  // namespace slsd
