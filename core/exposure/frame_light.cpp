// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/frame_light.hpp"

#include <algorithm>
#include <cmath>

namespace slsd {

double FrameLight::noise_at(double level) const {
  if (!between.neighbours || between.levels.empty()) return noise.at(static_cast<float>(level));
  const auto away = [&](const LevelNoise& at) { return std::abs(at.level - level); };
  return std::sqrt(std::ranges::min(between.levels, {}, away).variance);
}

FrameLight measure_frame_light(const GreyView& first, const std::optional<GreyView>& second, double full) {
  FrameLight light;
  int all = 0;
  light.tiles = measure_tiles(first, full, all);
  light.levels = summarize(light.tiles, all, full);
  light.noise = measure_noise(first, full);
  if (!second) return light;
  light.change = compare_frames(first, *second);
  light.between = noise_between(first, *second, *light.change, full);
  light.gamma = estimate_gamma(light.between, full);
  return light;
}

}  // namespace slsd
