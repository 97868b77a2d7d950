// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <limits>

#include <Eigen/Core>

#include "core/image.hpp"

namespace slsd {

/// A corner of a triangle as the viewer sees it.
struct ReliefVertex {
  Eigen::Vector3d place;   ///< picture px, with depth in the same scale, growing away from the viewer
  Eigen::Vector3d normal;  ///< of either orientation and any length
  double colour_share;     ///< argument of depth_colour()
  double brightness = 1;   ///< brightness of a disc: 0 is black
};

/// Direction to the light, rig frame: from the upper left, behind the viewer.
[[nodiscard]] Eigen::Vector3d light_direction();

/// A shaded layer with hidden surfaces removed, sampled kSamples x kSamples times per pixel.
/// @thread thread-bound
class Relief {
 public:
  /// @param forward  the viewer's direction, rig frame
  Relief(int width_px, int height_px, const Eigen::Vector3d& forward);

  void triangle(const std::array<ReliefVertex, 3>& corners);
  /// Draws a disc that faces the viewer.
  void disc(const ReliefVertex& centre, double radius_px);
  /// Draws the layer over a picture of its size. At jumps of depth, the nearer side gets a thin dark outline.
  /// @param jump  in the places' scale
  void compose(ColourImage& picture, double jump) const;

  static constexpr int kSamples = 2;

 private:
  void sample(int x, int y, double depth, const Eigen::Vector3d& normal, Rgb colour);
  [[nodiscard]] bool outlined(int x, int y, float jump) const;

  Eigen::Vector3d forward_;
  Image<float> depth_;
  ColourImage colour_;
};

}  // namespace slsd
