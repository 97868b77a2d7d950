// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/x11/choose_output.hpp"

#include <algorithm>
#include <cstdio>
#include <iterator>

#include "core/image_size.hpp"

namespace slsd {
namespace {

std::string place_text(const DesktopArea& area) {
  char text[32];
  std::snprintf(text, sizeof text, "%+d%+d", area.x_px, area.y_px);
  return text;
}

std::string names_of(std::span<const RandrOutput> outputs) {
  std::string names;
  for (const RandrOutput& output : outputs) (names += names.empty() ? "" : "; ") += describe_output(output);
  return names.empty() ? "no monitor is plugged in" : "plugged in: " + names;
}

std::string turn_on(const RandrOutput& output) {
  return "run xrandr --output " + output.name + " --auto, or set [projector] enable_output = true";
}

tl::unexpected<Error> not_there(const std::string& which, std::span<const RandrOutput> outputs) {
  return fail(ErrorCode::kNotFound,
              which + "; " + names_of(outputs) + ". Check its cable and its power, or change [projector] monitor",
              "projector");
}

// Without a primary monitor on the desktop, the first one counts as primary.
std::vector<RandrOutput> others_than_primary(std::span<const RandrOutput> outputs) {
  auto primary = std::ranges::find_if(outputs, &RandrOutput::primary);
  if (primary == outputs.end()) primary = outputs.begin();
  std::vector<RandrOutput> others;
  for (const RandrOutput& output : outputs) {
    if (output.id != primary->id) others.push_back(output);
  }
  return others;
}

bool is_meant(const RandrOutput& output, const std::string& name) {
  return output.name == name || output.serial == name || (output.on && place_text(output.area) == name);
}

}  // namespace

std::string describe_output(const RandrOutput& output) {
  std::string text = output.name;
  if (!output.model.empty()) text += ", " + output.model;
  if (!output.serial.empty()) text += ", serial " + output.serial;
  if (!output.on) return text + ", off";
  char refresh[32];
  std::snprintf(refresh, sizeof refresh, " at %.2f Hz, ", output.refresh_hz);
  text += ", " + size_text(output.area.width_px, output.area.height_px) + refresh + place_text(output.area);
  return output.primary ? text + ", primary" : text;
}

Result<RandrOutput> choose_output(std::span<const RandrOutput> outputs, const std::string& wanted,
                                  const std::string& last, bool enable) {
  const std::string& name = wanted.empty() ? last : wanted;
  if (!name.empty()) {
    const auto found = std::ranges::find_if(outputs, [&](const RandrOutput& output) { return is_meant(output, name); });
    if (found == outputs.end()) return not_there("the monitor \"" + name + "\" is not plugged in", outputs);
    if (found->on || enable) return *found;
    return fail(ErrorCode::kNotFound, "the monitor \"" + name + "\" is plugged in, but off: " + turn_on(*found),
                "projector");
  }
  std::vector<RandrOutput> usable;
  std::ranges::copy_if(outputs, std::back_inserter(usable),
                       [&](const RandrOutput& output) { return output.on || enable; });
  if (usable.empty() && !outputs.empty()) return not_there("no monitor is on: " + turn_on(outputs.front()), outputs);
  if (usable.empty()) return not_there("the projector is not plugged in", outputs);
  if (usable.size() == 1) return usable.front();
  const auto others = others_than_primary(usable);
  if (others.size() == 1) return others.front();
  return fail(ErrorCode::kInvalidArgument, "set [projector] monitor to the projector's monitor; " + names_of(outputs),
              "projector");
}

Result<> check_fit(const RandrOutput& output, int width_px, int height_px) {
  const std::string where = "monitor " + output.name;
  const std::string size = size_text(width_px, height_px);
  const std::string xrandr = "xrandr --output " + output.name;
  if (!output.on) return fail(ErrorCode::kMismatch, "it is off: " + turn_on(output), where);
  if (output.transformed) {
    return fail(ErrorCode::kMismatch, "its picture is scaled: run " + xrandr + " --scale 1x1 --transform none", where);
  }
  if (output.pans()) {
    return fail(ErrorCode::kMismatch,
                "it pans over " + size_text(output.area.width_px, output.area.height_px) + " pixels with a mode of " +
                    size_text(output.mode_width_px, output.mode_height_px) + ": run " + xrandr + " --panning 0x0",
                where);
  }
  if (output.area.width_px == width_px && output.area.height_px == height_px) return {};
  if (output.rotation_deg % 180 != 0 && output.area.width_px == height_px && output.area.height_px == width_px) {
    return fail(ErrorCode::kMismatch, "its picture is rotated: run " + xrandr + " --rotate normal", where);
  }
  return fail(ErrorCode::kMismatch,
              "it shows " + size_text(output.area.width_px, output.area.height_px) + " pixels, but [projector] says " +
                  size + ": set width_px and height_px to its native size" +
                  (output.native_width_px > 0 ? ", " + size_text(output.native_width_px, output.native_height_px)
                                              : std::string()) +
                  ", or run " + xrandr + " --mode " + size,
              where);
}

std::vector<std::string> output_warnings(const RandrOutput& output, std::span<const RandrOutput> outputs) {
  std::vector<std::string> warnings;
  const std::string xrandr = "run xrandr --output " + output.name;
  const bool native =
      output.mode_width_px == output.native_width_px && output.mode_height_px == output.native_height_px;
  if (output.native_width_px > 0 && !native) {
    warnings.push_back("its native size is " + size_text(output.native_width_px, output.native_height_px) +
                       ": it scales and blurs the pattern; use that size");
  }
  for (const RandrOutput& other : outputs) {
    if (other.id == output.id || !overlap(other.area, output.area)) continue;
    warnings.push_back("it mirrors " + other.name + ", so windows there cover the pattern: " + xrandr + " --right-of " +
                       other.name);
  }
  if (output.rotation_deg != 0 || output.reflected) {
    warnings.push_back("its picture is rotated or reflected: keep it as it was when calibrating, or " + xrandr +
                       " --rotate normal --reflect normal");
  }
  if (output.gamma_active) {
    warnings.push_back("an active gamma table changes grey values: " + xrandr +
                       " --gamma 1:1:1, and turn off night light and colour management");
  }
  if (!output.rgb_range.empty() && output.rgb_range != "Full") {
    warnings.push_back("its RGB range is \"" + output.rgb_range + "\", so black may not be dark: " + xrandr +
                       " --set \"Broadcast RGB\" Full");
  }
  if (output.underscan) warnings.push_back("underscan scales the pattern: " + xrandr + " --set underscan off");
  if (output.name.starts_with("XWAYLAND")) {
    warnings.push_back("a Wayland session may scale, delay and cover the pattern: use an X server");
  }
  return warnings;
}

Result<MonitorReport> report_monitor(const std::string& wanted, int width_px, int height_px, bool enable) {
  const auto outputs = list_outputs();
  if (!outputs) return tl::unexpected(outputs.error());
  auto output = choose_output(*outputs, wanted, {}, enable);
  if (!output) return tl::unexpected(output.error());
  const auto fits = check_fit(*output, width_px, height_px);
  const bool will_fit =
      enable && !output->transformed && !output->pans() && find_mode(*output, width_px, height_px, 0) != nullptr;
  if (!fits && !will_fit) return tl::unexpected(fits.error());
  if (!fits) {
    const std::string now = output->on ? "it has another size" : "it is off";
    return MonitorReport{std::move(*output), {now + ": slsd sets it to the right size"}};
  }
  auto warnings = output_warnings(*output, *outputs);
  return MonitorReport{std::move(*output), std::move(warnings)};
}

}  // namespace slsd
