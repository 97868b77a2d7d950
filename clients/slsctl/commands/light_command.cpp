// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cmath>
#include <ostream>

#include <fmt/format.h>

#include "clients/slsctl/commands/client_commands.hpp"
#include "clients/slsctl/look_at_light.hpp"
#include "clients/slsctl/output.hpp"
#include "clients/slsctl/report.hpp"
#include "core/printable.hpp"
#include "drivers/files/encode_png.hpp"
#include "picture/draw_light.hpp"
#include "rpc/message.hpp"

namespace slsd {
namespace {

using nlohmann::json;

json noise_levels_json(const NoiseBetween& noise) {
  json levels = json::array();
  for (const LevelNoise& at : noise.levels) levels.push_back({{"level", at.level}, {"sigma", std::sqrt(at.variance)}});
  return levels;
}

json gamma_json(const std::optional<CameraGamma>& gamma) {
  if (!gamma) return nullptr;
  return {{"likeliest", gamma->likeliest}, {"low", gamma->low}, {"high", gamma->high}};
}

json pitch_json(const std::optional<PatternPitch>& pitch) {
  if (!pitch) return nullptr;
  return {{"pitch_px", pitch->pitch_px}, {"unevenness_px", pitch->unevenness_px}};
}

json change_json(const std::optional<FrameChange>& change) {
  if (!change) return nullptr;
  return {{"noise", change->noise},
          {"moved_share", change->moved_share},
          {"brighter", change->brighter},
          {"bands", change->bands}};
}

json light_json(const SeenLight& seen) {
  const FrameLight& light = seen.light;
  const LightLevels& levels = light.levels;
  const auto& neighbours = light.between.neighbours;
  return {{"camera", seen.camera},
          {"full", levels.full},
          {"lit", levels.lit},
          {"dark", levels.dark},
          {"room_light", levels.room_light()},
          {"clipped_share", levels.clipped_share},
          {"clipped_of_lit", levels.clipped_of_lit},
          {"patterned_share", levels.patterned_share},
          {"edge_px", levels.edge_px},
          {"period_px", levels.period_px},
          {"noise_dark", light.noise_at(levels.dark)},
          {"noise_lit", light.noise_at(levels.lit)},
          {"noise_levels", noise_levels_json(light.between)},
          {"grain", neighbours ? json(*neighbours) : json()},
          {"gamma", gamma_json(light.gamma)},
          {"pitch", pitch_json(light.pitch)},
          {"change", change_json(light.change)},
          {"troubles", troubles_json(seen.advice.troubles)}};
}

std::string levels_text(const FrameLight& light) {
  const LightLevels& levels = light.levels;
  if (levels.patterned_share == 0) return "the pattern is not visible\n";
  return fmt::format(
      "pattern       on {:.0f} % of the frame\nlevel         symbols {:.0f} of {:.0f}, between them {:.0f}\nblur       "
      "   edges {:.2f} px wide, {:.3f} of the period of {:.1f} px\nclipped       {:.0f} % of the symbols' pixels, "
      "symbols on {:.0f} % of the pattern\nroom light    {:.2f} times the pattern's, including scattered light\nnoise  "
      "       {:.1f} between the symbols, {:.1f} on them\n",
      100 * levels.patterned_share, levels.lit, levels.full, levels.dark, levels.edge_px,
      levels.edge_px / levels.period_px, levels.period_px, 100 * levels.clipped_of_lit, 100 * levels.clipped_share,
      levels.room_light(), light.noise_at(levels.dark), light.noise_at(levels.lit));
}

std::string change_text(const FrameLight& light) {
  if (!light.change) return "grain, gamma, change  not measurable with one frame\n";
  const FrameChange& change = *light.change;
  const auto& neighbours = light.between.neighbours;
  return "grain         " +
         (neighbours ? fmt::format("noise of neighbouring pixels correlates by {:.2f}\n", *neighbours)
                     : "not measurable: hardly any noise\n") +
         "gamma         " +
         (light.gamma ? fmt::format("{:.2f}, from {:.2f} to {:.2f}; 1: levels are proportional to light\n",
                                    light.gamma->likeliest, light.gamma->low, light.gamma->high)
                      : "not measurable: the noise is inconclusive\n") +
         fmt::format("change        brightness {:+.1f} %, bands {:.1f} %, {:.0f} % of the frame moved\n",
                     100 * (change.brighter - 1), 100 * change.bands, 100 * change.moved_share);
}

std::string pitch_text(const FrameLight& light) {
  if (!light.pitch) return "pitch         not measurable: no scan, or too few symbols in it\n";
  return fmt::format("pitch         {:.2f} px from column to column, uneven by {:.3f} px\n", light.pitch->pitch_px,
                     light.pitch->unevenness_px);
}

std::string light_text(const SeenLight& seen) {
  const std::string camera = seen.camera.empty() ? "" : fmt::format("camera        \"{}\"\n", printable(seen.camera));
  return camera + levels_text(seen.light) + change_text(seen.light) + pitch_text(seen.light) +
         troubles_text(seen.advice.troubles);
}

tl::expected<void, Failure> write_light_picture(const ClientOptions& options, const SeenLight& seen) {
  if (options.picture.empty()) return {};
  const auto png = encode_png(draw_light(view(seen.frame), seen.light.tiles));
  if (!png) return tl::unexpected(Failure{kRequestFailed, rpc_error(png.error())});
  return write_output(options.picture, *png);
}

}  // namespace

int light_command(const ClientOptions& options) {
  if (auto writable = check_outputs(options); !writable) return report(options, writable.error());
  const auto seen = look_at_light(options, LookAtPitch::kYes);
  if (!seen) return report(options, seen.error());
  if (auto written = write_light_picture(options, *seen); !written) return report(options, written.error());
  words(options) << (options.json ? to_line(light_json(*seen)) : light_text(*seen));
  return kDone;
}

}  // namespace slsd
