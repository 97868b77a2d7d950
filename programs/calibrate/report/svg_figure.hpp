// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <string_view>

#include <Eigen/Core>

namespace slsd {

/// Escapes text for HTML and SVG.
/// @thread reentrant
[[nodiscard]] std::string escaped(std::string_view text);

/// A colour for each pose, distinct from the next: "hsl(...)".
/// @thread reentrant
[[nodiscard]] std::string pose_colour(std::size_t pose);

/// Maps a drawing's coordinates onto a figure, with the same scale in both directions, and draws shapes there.
/// @thread thread-bound
class SvgFigure {
 public:
  /// @param first, corners of the drawn area, in its own units; x to the right, y down
  /// @param width_px     of the figure; its height follows
  SvgFigure(const Eigen::Vector2d& first, const Eigen::Vector2d& last, double width_px);

  void line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, std::string_view colour, double width_px = 1);
  void dot(const Eigen::Vector2d& at, double radius_px, std::string_view colour);
  void rectangle(const Eigen::Vector2d& first, const Eigen::Vector2d& last, std::string_view fill);
  void frame();
  void text(const Eigen::Vector2d& at, std::string_view words, std::string_view anchor = "start");

  /// Figure px for one unit of the drawing.
  [[nodiscard]] double scale() const { return scale_; }
  [[nodiscard]] std::string str(std::string_view caption) const;

 private:
  [[nodiscard]] Eigen::Vector2d place(const Eigen::Vector2d& at) const { return (at - first_) * scale_; }

  Eigen::Vector2d first_;
  Eigen::Vector2d last_;
  double scale_;
  std::string shapes_;
};

}  // namespace slsd
