// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include <Eigen/Core>

#include "core/geometry/calibration.hpp"
#include "core/image.hpp"
#include "tests/simulator/surface.hpp"

namespace slsd {

struct SimulationOptions {
  double dark = 20;          ///< grey value of the surface where the pattern is dark, or nothing is
  double lit = 170;          ///< and where it is lit
  double falloff = 1;        ///< light at the left edge over light at the right edge of the frame
  double blur_sigma_px = 1;  ///< of the camera's lens
  double noise_sigma = 2;    ///< grey values, one standard deviation
  std::uint32_t seed = 1;    ///< of the noise
};

/// The rig of Elahi et al. 2020: camera 1600x1200 that sees 900 mm at 2 m, projector 1280x800 that lights 1000 mm at
/// 1.96 m, 180 mm to the right of the camera and aimed at the same point of the plane z = 2000 mm.
[[nodiscard]] Calibration paper_rig();

/// What a camera sees when the projector shows an image on a surface: shadows and sensor noise, no shading.
/// @param pattern  the projector's image, of its size
[[nodiscard]] Grey8 simulate(const Grey8& pattern, const Calibration& calibration, const Surface& surface,
                             const SimulationOptions& options = {}, std::size_t camera_index = 0);

/// Where the camera sees the light of a projector pixel, exactly; nothing where the surface is not lit by it, or hides
/// it from the camera. The result may lie outside the frame.
[[nodiscard]] std::optional<Eigen::Vector2d> camera_from_projector(const Eigen::Vector2d& projector_px,
                                                                   const Calibration& calibration,
                                                                   const Surface& surface,
                                                                   std::size_t camera_index = 0);

/// The projector pixel that lights what the camera sees at a pixel; nothing in shadow.
[[nodiscard]] std::optional<Eigen::Vector2d> projector_from_camera(const Eigen::Vector2d& camera_px,
                                                                   const Calibration& calibration,
                                                                   const Surface& surface,
                                                                   std::size_t camera_index = 0);

}  // namespace slsd
