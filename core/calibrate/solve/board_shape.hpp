// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace slsd {

/// Shape of a board that is not flat, equal in all poses: a polynomial of orders two to four over its plane. A plane
/// would be part of the pose. Each term is the height (mm) that it adds where its powers of u and v are one,
///
///     u = (x - middle_x) / half,  v = (y - middle_y) / half
///
/// u^2, u v, v^2, then the third and the fourth order. A parameter block of the adjustment.
inline constexpr std::size_t kShapeTerms = 12, kSecondOrderTerms = 3;
using ShapeVector = std::array<double, kShapeTerms>;

/// Centre and size of a shape.
struct ShapeFrame {
  Eigen::Vector2d middle_mm = Eigen::Vector2d::Zero();
  double half_mm = 1;  ///< half of the longer side
};

/// A shape at one point of the board.
struct ShapeAt {
  double height_mm = 0;                                             ///< above the board's plane, along its z axis
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();                  ///< slope of the height along x and y
  Eigen::Matrix<double, 1, static_cast<int>(kShapeTerms)> by_term;  ///< derivative of the height with respect to the
                                                                    ///< terms
};

/// Evaluates a shape at a point. Beyond two halves of the longer side from the centre, the height stays constant, so
/// that all rays meet the shape. It neglects that a bent print is shorter: 0.003 % for a bend of 1.5 mm over 336 mm.
/// @thread reentrant
[[nodiscard]] ShapeAt shape_at(const double* terms_mm, const ShapeFrame& frame, const Eigen::Vector2d& board_mm);

/// Intersects a ray with a shape, in the board's frame, by Newton's method starting at the plane.
/// @return empty if the ray misses the shape, for example parallel to it, or if Newton's method does not converge
/// @thread reentrant
[[nodiscard]] std::optional<Eigen::Vector3d> meet_shape(const double* terms_mm, const ShapeFrame& frame,
                                                        const Eigen::Vector3d& eye, const Eigen::Vector3d& ray);

struct BoardShape {
  ShapeFrame frame;
  ShapeVector terms_mm{};

  [[nodiscard]] double height_mm(const Eigen::Vector2d& board_mm) const {
    return shape_at(terms_mm.data(), frame, board_mm).height_mm;
  }
};

/// Size that each term may have before any observation: one standard deviation. Prints on foam board are bent by some
/// mm; terms above the second order are a small part of that.
[[nodiscard]] ShapeVector plausible_shape(const ShapeFrame& frame);

}  // namespace slsd
