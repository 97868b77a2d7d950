// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <vector>

#include "core/image.hpp"
#include "tests/adversary/random_numbers.hpp"
#include "tests/adversary/scenes/depth_scene.hpp"

namespace slsd::adversary {

/// The light of a projector and a room, and the camera that takes the picture.
struct SceneLight {
  double blur_px = 0.4;                ///< Gaussian core of the camera's point spread
  bool halo = false;                   ///< 6 % of the light in a halo of 5 px, 11 % in one of 30 px, 5 % everywhere
  double room = 0;                     ///< light of the room over the projector's white
  double gain = 1;                     ///< 1: the brightest places are just below full level
  double noise = 0.05;                 ///< variance, grey levels, for each grey level
  double floor = 0.3;                  ///< variance in the dark
  double black = 0.005;                ///< projector's black over its white
  double vignette = 0;                 ///< share of its light that the projector loses in its corners
  std::array<double, 2> room_slope{};  ///< change of the room's light across and down the image
  double gamma = 1;                    ///< grey = linear ^ gamma
  double sharpen = 0;                  ///< share by which an edge overshoots
  double grain_px = 0;                 ///< correlation length of the noise
  double bands = 0;                    ///< share of the room's light that mains and a rolling shutter turn into bands
  double band_phase = 0;

  /// Draws all of it: laboratory to lit room, dim to clipped, industrial camera or webcam.
  [[nodiscard]] static SceneLight draw(Random& random);
  /// A dark laboratory, a sharp lens and a good exposure.
  [[nodiscard]] static SceneLight clean();
};

/// Takes the picture.
/// @param shown  the projector's image
/// @param noise  noise_table()
[[nodiscard]] Grey8 expose(const SceneTruth& truth, const Grey8& shown, const SceneLight& light,
                           const std::vector<float>& noise, Random& random);

}  // namespace slsd::adversary
