// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>

#include <Eigen/Core>

#include "core/geometry/homography.hpp"
#include "core/image.hpp"

namespace slsd {

/// A black disc on white, in an image.
struct Disc {
  Eigen::Vector2d centroid;  ///< centroid of the ellipse, weighted by grey levels
  double step = 0;           ///< white minus black, levels
  double blur_px = 0;        ///< one standard deviation at its edge
};

/// Weights the pixels of a disc by their blackness relative to the surrounding white, which is fitted by a plane.
/// @param local  homography of the disc's surroundings
/// @return       empty if the disc leaves the image or has no contrast
/// @thread reentrant
[[nodiscard]] std::optional<Disc> measure_disc(const Image<float>& light, const Homography& local,
                                               const Eigen::Vector2d& centre_mm, double radius_mm, double clear_mm);

/// Vector from the image of a disc's centre to the centre of the ellipse that outlines it.
/// @return px
/// @thread reentrant
[[nodiscard]] Eigen::Vector2d perspective_bias(const Homography& local, const Eigen::Vector2d& centre_mm,
                                               double radius_mm);

}  // namespace slsd
