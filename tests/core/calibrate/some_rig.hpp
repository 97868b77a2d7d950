// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <string>

#include "core/calibrate/calibrate.hpp"
#include "tests/core/calibrate/synthetic_rig.hpp"

namespace slsd {

/// A rig unlike others: focal lengths, distortions and baseline of its own.
inline RigModel some_rig(std::mt19937& random) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto lens = [&](double focal, double cx, double cy) {
    const double k1 = uniform(-0.32, 0.08);
    return LensVector{focal * uniform(0.8, 1.2),
                      0,
                      cx + uniform(-15, 15),
                      cy + uniform(-15, 15),
                      k1,
                      -0.7 * k1 * uniform(0, 1.3),
                      uniform(-0.0015, 0.0015),
                      uniform(-0.0015, 0.0015),
                      0.3 * k1 * uniform(0, 1)};
  };
  RigModel rig = true_rig();
  rig.cameras[0].lens = lens(3300, 800, 600), rig.projector.lens = lens(2500, 640, 436);
  rig.cameras[0].lens[1] = rig.cameras[0].lens[0] * uniform(0.999, 1.001);
  rig.projector.lens[1] = rig.projector.lens[0] * uniform(0.999, 1.001);
  const double share = uniform(0.6, 1.8);
  rig.projector.device_from_rig[1] *= share, rig.projector.device_from_rig[3] *= share;
  return rig;
}

/// What a parameter of a report is in truth.
inline double truth_of(const ParameterReport& parameter, const RigModel& truth) {
  const DeviceModel& device = parameter.device == "projector" ? truth.projector : truth.cameras[0];
  for (std::size_t i = 0; i < device.lens.size(); ++i) {
    if (kLensParameterNames[i] == parameter.name) return device.lens[i];
  }
  const std::map<std::string, std::size_t> motion{{"turn_x", 0},  {"turn_y", 1},  {"turn_z", 2},
                                                  {"place_x", 3}, {"place_y", 4}, {"place_z", 5}};
  return device.device_from_rig[motion.at(parameter.name)];
}

/// Errors in reported deviations.
struct Ratios {
  double squares = 0, worst = 0;
  int count = 0;

  void add(double ratio) { squares += ratio * ratio, worst = std::max(worst, std::abs(ratio)), ++count; }
  [[nodiscard]] double rms() const { return std::sqrt(squares / count); }
};

}  // namespace slsd
