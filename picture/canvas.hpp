// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include <Eigen/Core>

#include "core/image.hpp"

namespace slsd {

enum class Align { kLeft, kCentre, kRight };

/// Draws with smooth edges into a picture, at sub-pixel positions; clips at its borders.
/// @thread thread-bound
class Canvas {
 public:
  /// @param picture  drawn into; must outlive the canvas
  explicit Canvas(ColourImage& picture) : picture_(picture) {}

  void line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, Rgb colour, int thickness_px = 1);
  /// A dashed line; each dash is as long as the gap behind it.
  void dashes(const Eigen::Vector2d& from, const Eigen::Vector2d& to, Rgb colour, int thickness_px, double dash_px);
  void disc(const Eigen::Vector2d& centre, double radius_px, Rgb colour);
  /// A plus sign; arm_px from its centre to each end.
  void plus(const Eigen::Vector2d& centre, double arm_px, Rgb colour, int thickness_px = 1);
  void rectangle(int left, int top, int width, int height, Rgb colour);
  /// Draws one line of text; non-ASCII bytes become question marks.
  /// @param place  the end of the base line that `align` names, or its middle
  void text(const Eigen::Vector2d& place, const std::string& words, double height_px, Rgb colour,
            Align align = Align::kLeft);
  [[nodiscard]] static double text_width_px(const std::string& words, double height_px);

 private:
  ColourImage& picture_;
};

/// A colour between two: 0 gives a, 1 gives b.
[[nodiscard]] Rgb mix(Rgb a, Rgb b, double share);

}  // namespace slsd
