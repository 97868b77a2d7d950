// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/board/board.hpp"
#include "core/geometry/lens.hpp"
#include "core/image.hpp"

namespace slsd {

/// A camera that looks at a printed board. Pixels are the mean of the light on their area, blurred, with noise.
struct BoardScene {
  Board board;
  Lens camera;
  Eigen::Matrix3d camera_from_board = Eigen::Matrix3d::Identity();
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();  ///< of the board, in the camera's frame
  double blur_px = 0.7;
  double noise_levels = 1.5;
  double white = 190;        ///< levels, where the light is brightest
  double black = 15;         ///< likewise
  double falling_light = 0;  ///< share of the light that is gone at the image's right edge; half of it at the lower
  double border_mm = 1000;   ///< of white around the board; grey beyond
  bool legacy = false;       ///< ChArUco of even rows and columns as OpenCV before 4.6 drew it
  unsigned seed = 1;

  [[nodiscard]] Eigen::Vector2d pixel(int id) const;  ///< where a point of the board is
};

/// A board face on and a little turned, in the middle of an image of 640 x 480, with squares of a size.
/// @param tilt_rad  about an axis that is neither upright nor level
[[nodiscard]] BoardScene scene_of(const Board& board, double pitch_px, double tilt_rad);

/// In levels of 0 to 255.
[[nodiscard]] Image<float> photograph_scene(const BoardScene& scene);
[[nodiscard]] Grey8 photograph8(const BoardScene& scene);
[[nodiscard]] Grey16 photograph16(const BoardScene& scene);  ///< in levels of 0 to 65535

}  // namespace slsd
