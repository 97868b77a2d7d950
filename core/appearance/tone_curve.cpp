// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/appearance/tone_curve.hpp"

#include <algorithm>
#include <cmath>
#include <variant>

namespace slsd {

void ToneCurve::set_power(float power) {
  constexpr float kLeast = 0.3F, kStraight = 0.92F;
  const float used = power > kStraight || !std::isfinite(power) ? 1 : std::max(power, kLeast);
  if (used != power_) lights_.clear();
  power_ = used;
}

const Grey16& ToneCurve::light_of(const GreyView& frame, double full) {
  if (lights_.empty() || lights_full_ != full) {
    lights_.resize(static_cast<std::size_t>(full) + 1), lights_full_ = full;
    for (std::size_t level = 0; level < lights_.size(); ++level)
      lights_[level] = static_cast<std::uint16_t>(
          std::lround(kFull * std::pow(static_cast<double>(level) / full, 1 / static_cast<double>(power_))));
  }
  std::visit(
      [&](const auto& pixels) {
        if (light_.width() != pixels.width || light_.height() != pixels.height)
          light_ = Grey16(pixels.width, pixels.height);
        for (int y = 0; y < pixels.height; ++y)
          std::transform(pixels.row(y), pixels.row(y) + pixels.width, light_.row(y),
                         [&](auto level) { return lights_[std::min<std::size_t>(level, lights_.size() - 1)]; });
      },
      frame);
  return light_;
}

float ToneCurve::light_of(float level, double full) const {
  const float share = std::clamp(level / static_cast<float>(full), 0.F, 1.F);
  return static_cast<float>(kFull) * std::pow(share, 1 / power_);
}

std::array<std::uint8_t, 256> ToneCurve::levels_of_lights() const {
  std::array<std::uint8_t, 256> levels;
  for (std::size_t light = 0; light < levels.size(); ++light)
    levels[light] = static_cast<std::uint8_t>(std::lround(255 * std::pow(static_cast<float>(light) / 255, power_)));
  return levels;
}

}  // namespace slsd
