// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cmath>
#include <random>

#include "tests/core/exposure/corpus_frame.hpp"

namespace slsd {

/// A camera whose levels are light to the power `gamma`, with photon noise.
struct SimulatedCamera {
  double gamma = 1;
  double photons = 0.054;  ///< variance per level, in linear light
  double sensor = 0.35;    ///< variance
  int grain = 0;           ///< radius of the square over which noise is averaged, as denoising does; px
};

/// The scene as the camera sees it, which differs from frame to frame by the noise of the seed.
inline Grey8 seen_by(const SimulatedCamera& camera, const Grey8& scene, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> gauss(0, 1);
  Image<double> noise(scene.width(), scene.height());
  for (std::size_t i = 0; i < noise.size(); ++i) noise.data()[i] = gauss(random);
  const int side = 2 * camera.grain + 1;
  Grey8 seen(scene.width(), scene.height());
  for (int y = 0; y < scene.height(); ++y) {
    for (int x = 0; x < scene.width(); ++x) {
      double sum = 0;
      for (int i = 0; i < side * side; ++i) {
        sum += noise.at(std::clamp(x + i % side - camera.grain, 0, scene.width() - 1),
                        std::clamp(y + i / side - camera.grain, 0, scene.height() - 1));
      }
      const double light = scene.at(x, y) + sum / side * std::sqrt(camera.photons * scene.at(x, y) + camera.sensor);
      const double level = 255 * std::pow(std::clamp(light / 255, 0.0, 1.0), camera.gamma);
      seen.at(x, y) = static_cast<std::uint8_t>(std::lround(level));
    }
  }
  return seen;
}

}  // namespace slsd
