// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
// Derivatives by the chain rule, by hand: Ceres' automatic ones, with 36 slopes to a number, would take most of a
// calibration's time.
#include "core/calibrate/solve/residuals.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "core/calibrate/solve/rig_model.hpp"

namespace slsd {
namespace {

template <int kColumns>
using Slopes = Eigen::Matrix<double, 2, kColumns>;

/// The matrix of the cross product with a vector.
Eigen::Matrix3d cross(const Eigen::Vector3d& by) {
  Eigen::Matrix3d matrix;
  matrix << 0, -by.z(), by.y(), by.z(), 0, -by.x(), -by.y(), by.x(), 0;
  return matrix;
}

/// A rotation by an angle-axis vector (Rodrigues' formula), and its derivative with respect to that vector.
class Turn {
 public:
  explicit Turn(const double* angle_axis) {
    constexpr double kStill = 1e-9;
    const Eigen::Map<const Eigen::Vector3d> vector(angle_axis);
    const double angle = vector.norm();
    if (angle < kStill) {
      matrix_ = Eigen::Matrix3d::Identity() + cross(vector);
      turned_on_ = Eigen::Matrix3d::Identity() + 0.5 * cross(vector);
      return;
    }
    const Eigen::Vector3d axis = vector / angle;
    const Eigen::Matrix3d across = cross(axis);
    const double sine = std::sin(angle), half = std::sin(0.5 * angle), versine = 2 * half * half;
    matrix_ = Eigen::Matrix3d::Identity() + sine * across + versine * across * across;
    const double share = sine / angle;
    turned_on_ = share * Eigen::Matrix3d::Identity() + (1 - share) * axis * axis.transpose() + versine / angle * across;
  }

  [[nodiscard]] const Eigen::Matrix3d& matrix() const { return matrix_; }
  /// Derivatives of a rotated point with respect to the angle-axis vector.
  [[nodiscard]] Eigen::Matrix3d slopes_at(const Eigen::Vector3d& turned) const { return -cross(turned) * turned_on_; }
  /// The same for a point rotated back.
  [[nodiscard]] Eigen::Matrix3d slopes_back_at(const Eigen::Vector3d& turned) const {
    return cross(turned) * turned_on_.transpose();
  }

 private:
  Eigen::Matrix3d matrix_, turned_on_;
};

Lens lens_of(const double* block) {
  LensVector values;
  std::copy_n(block, values.size(), values.begin());
  return to_lens(values, {});
}

/// Derivatives of Lens::distort() with respect to the lens (Elahi et al. 2020, equations (24) to (28)).
Slopes<9> slopes_by_lens(const Lens& lens, const Eigen::Vector2d& direction) {
  const auto& [k1, k2, p1, p2, k3] = lens.distortion;
  const double x = direction.x(), y = direction.y(), r2 = x * x + y * y;
  const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const Eigen::Vector2d towards(lens.fx * x * r2, lens.fy * y * r2);
  Slopes<9> slopes = Slopes<9>::Zero();
  slopes(0, 0) = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
  slopes(1, 1) = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
  slopes(0, 2) = slopes(1, 3) = 1;
  slopes.col(4) = towards;
  slopes.col(5) = towards * r2;
  slopes.col(6) << lens.fx * 2 * x * y, lens.fy * (r2 + 2 * y * y);
  slopes.col(7) << lens.fx * (r2 + 2 * x * x), lens.fy * 2 * x * y;
  slopes.col(8) = towards * r2 * r2;
  return slopes;
}

template <int kColumns>
void put(double** slopes, int block, const Slopes<kColumns>& of) {
  if (slopes == nullptr || slopes[block] == nullptr) return;
  for (int row = 0; row < 2; ++row)
    for (int column = 0; column < kColumns; ++column) slopes[block][row * kColumns + column] = of(row, column);
}

/// A point of the rig's frame, seen by a camera whose lens and place are the first two blocks.
class Sight {
 public:
  Sight(const double* const* blocks, const Eigen::Vector3d& point)
      : lens_(lens_of(blocks[0])),
        turn_(blocks[1]),
        turned_(turn_.matrix() * point),
        at_(turned_ + Eigen::Map<const Eigen::Vector3d>(blocks[1] + 3)) {}

  void put_residual(const Eigen::Vector2d& seen_px, double sigma_px, double* residual) const {
    Eigen::Map<Eigen::Vector2d>(residual, 2) = (lens_.distort(direction()) - seen_px) / sigma_px;
  }
  /// Writes the derivatives with respect to the camera; returns those with respect to the point.
  Slopes<3> put_slopes(double sigma_px, double** slopes) const {
    const double depth = at_.z();
    Slopes<3> projection;
    projection << 1 / depth, 0, -at_.x() / (depth * depth), 0, 1 / depth, -at_.y() / (depth * depth);
    const Slopes<3> by_shift = lens_.distort_jacobian(direction()) * projection / sigma_px;
    Slopes<6> by_place;
    by_place << by_shift * turn_.slopes_at(turned_), by_shift;
    put<9>(slopes, 0, slopes_by_lens(lens_, direction()) / sigma_px);
    put<6>(slopes, 1, by_place);
    return by_shift * turn_.matrix();
  }

 private:
  [[nodiscard]] Eigen::Vector2d direction() const { return at_.head<2>() / at_.z(); }

  Lens lens_;
  Turn turn_;
  Eigen::Vector3d turned_, at_;
};

}  // namespace

bool CornerResidual::Evaluate(const double* const* blocks, double* residual, double** slopes) const {
  const double larger = 1 + blocks[3][0], longer = 1 + blocks[4][0];
  const Turn board(blocks[2]);
  const Eigen::Vector2d printed(board_mm_.x() * larger, board_mm_.y() * larger * longer);
  const ShapeAt shape = shape_at(blocks[5], frame_, printed);
  const Eigen::Vector3d turned = board.matrix() * Eigen::Vector3d(printed.x(), printed.y(), shape.height_mm);
  const Sight sight(blocks, turned + Eigen::Map<const Eigen::Vector3d>(blocks[2] + 3));
  sight.put_residual(camera_px_, sigma_px_, residual);
  if (slopes == nullptr) return true;
  const Slopes<3> by_point = sight.put_slopes(sigma_px_, slopes);
  Slopes<6> by_board;
  by_board << by_point * board.slopes_at(turned), by_point;
  const Slopes<1> by_height = by_point * board.matrix().col(2);
  const Slopes<2> by_print = by_point * board.matrix().leftCols<2>() + by_height * shape.slope.transpose();
  put<6>(slopes, 2, by_board);
  put<1>(slopes, 3, by_print * Eigen::Vector2d(board_mm_.x(), board_mm_.y() * longer));
  put<1>(slopes, 4, by_print * Eigen::Vector2d(0, board_mm_.y() * larger));
  put<static_cast<int>(kShapeTerms)>(slopes, 5, by_height * shape.by_term);
  return true;
}

bool SymbolResidual::Evaluate(const double* const* blocks, double* residual, double** slopes) const {
  const Lens projector = lens_of(blocks[2]);
  const Turn turn(blocks[3]), board(blocks[4]);
  const Eigen::Vector2d direction = projector.undistort(projector_px_);
  const Eigen::Vector3d eye = -turn.matrix().transpose() * Eigen::Map<const Eigen::Vector3d>(blocks[3] + 3),
                        ray = turn.matrix().transpose() * direction.homogeneous(),
                        origin = Eigen::Map<const Eigen::Vector3d>(blocks[4] + 3);
  const Eigen::Matrix3d board_from_rig = board.matrix().transpose();
  const auto on_board = meet_shape(blocks[6], frame_, board_from_rig * (eye - origin), board_from_rig * ray);
  if (!on_board) return false;
  const Eigen::Vector3d turned = board.matrix() * *on_board, point = origin + turned;
  const Sight sight(blocks, point);
  sight.put_residual(camera_px_ - Eigen::Map<const Eigen::Vector2d>(blocks[5]), sigma_px_, residual);
  if (slopes == nullptr) return true;
  const Slopes<3> by_point = sight.put_slopes(sigma_px_, slopes);
  const ShapeAt shape = shape_at(blocks[6], frame_, on_board->head<2>());
  const Eigen::Vector3d normal = board.matrix() * Eigen::Vector3d(-shape.slope.x(), -shape.slope.y(), 1);
  const double towards = normal.dot(ray), along = ray.dot(point - eye) / ray.squaredNorm();
  // If the ray is shifted or turned, the point stays on the surface; if the surface moves, the point stays on the ray.
  const Slopes<3> by_shift = by_point - by_point * ray * (normal.transpose() / towards);
  const Slopes<1> by_step = by_point * ray / towards;
  const Slopes<2> by_direction = along * by_shift * turn.matrix().transpose().leftCols<2>();
  Slopes<6> by_place, by_board;
  by_place << by_shift * turn.slopes_back_at(point), -by_shift * turn.matrix().transpose();
  by_board << by_step * (normal.transpose() * board.slopes_at(turned)), by_step * normal.transpose();
  put<9>(slopes, 2,
         -by_direction * projector.distort_jacobian(direction).inverse() * slopes_by_lens(projector, direction));
  put<6>(slopes, 3, by_place);
  put<6>(slopes, 4, by_board);
  put<2>(slopes, 5, Slopes<2>::Identity() / sigma_px_);
  put<static_cast<int>(kShapeTerms)>(slopes, 6, by_step * shape.by_term);
  return true;
}

}  // namespace slsd
