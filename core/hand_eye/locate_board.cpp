// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/hand_eye/locate_board.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <opencv2/calib3d.hpp>

namespace slsd {
namespace {

constexpr std::size_t kCornersMin = 6;
constexpr int kLocatingRounds = 50;
constexpr double kLocated = 1e-10;
constexpr double kCornerBiasPx = 0.02;  // of find_board()
constexpr double kWeakest = 1e-9;       // share of the strongest direction
constexpr int kLensTerms = 4;

struct Corner {
  std::size_t camera;
  Eigen::Vector2d pixel;
  Eigen::Vector3d board_mm;
};

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d matrix;
  matrix << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return matrix;
}

RigidTransform moved(const RigidTransform& pose, const Vector6d& motion, const Eigen::Vector3d& middle_mm) {
  const double angle = motion.head<3>().norm();
  const Eigen::Matrix3d turn = angle > 0 ? Eigen::AngleAxisd(angle, motion.head<3>() / angle).toRotationMatrix()
                                         : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
  const Eigen::Vector3d middle = pose * middle_mm + motion.tail<3>();
  const Eigen::Matrix3d rotation = turn * pose.rotation;
  return {rotation, middle - rotation * middle_mm};
}

/// The residuals of all corners, linear in a small motion and in the shared errors.
struct Linear {
  Matrix6d normal = Matrix6d::Zero();
  Vector6d slope = Vector6d::Zero();
  Eigen::MatrixXd by_shared;
  double squares_px2 = 0;
  bool in_front = true;
};

Linear linearise(const std::vector<Corner>& corners, const Calibration& calibration,
                 const RigidTransform& rig_from_board, const Eigen::Vector3d& middle_mm) {
  Linear linear;
  linear.by_shared = Eigen::MatrixXd::Zero(6, 1 + kLensTerms * static_cast<Eigen::Index>(calibration.cameras.size()));
  const Eigen::Vector3d middle = rig_from_board * middle_mm;
  for (const Corner& corner : corners) {
    const CalibratedCamera& camera = calibration.cameras[corner.camera];
    const Eigen::Vector3d in_rig = rig_from_board * corner.board_mm;
    const Eigen::Matrix3d camera_from_rig = camera.rig_from_camera.rotation.transpose();
    const Eigen::Vector3d in_camera = camera_from_rig * (in_rig - camera.rig_from_camera.translation);
    if (!(in_camera.z() > 0)) {
      linear.in_front = false;
      return linear;
    }
    const double x = in_camera.x() / in_camera.z(), y = in_camera.y() / in_camera.z();
    Lens::View<double> seen;
    camera.lens.view(x, y, seen);
    Eigen::Matrix<double, 2, 3> by_point;
    by_point << seen.u_x, seen.u_y, -seen.u_x * x - seen.u_y * y, seen.v_x, seen.v_y, -seen.v_x * x - seen.v_y * y;
    by_point = (by_point / in_camera.z() * camera_from_rig).eval();
    Eigen::Matrix<double, 2, 6> by_motion;
    by_motion << by_point * -cross_matrix(in_rig - middle), by_point;
    const Eigen::Vector2d residual = Eigen::Vector2d(seen.u, seen.v) - corner.pixel;
    linear.normal += by_motion.transpose() * by_motion;
    linear.slope += by_motion.transpose() * residual;
    linear.squares_px2 += residual.squaredNorm();
    const Eigen::Index lens = 1 + kLensTerms * static_cast<Eigen::Index>(corner.camera);
    const auto add = [&](Eigen::Index term, const Eigen::Vector2d& by_term) {
      linear.by_shared.col(term) += by_motion.transpose() * by_term;
    };
    add(SharedErrors::kPrintScale, by_point * (rig_from_board.rotation * corner.board_mm));
    add(lens, Eigen::Vector2d((seen.u - camera.lens.cx) / camera.lens.fx, 0));
    add(lens + 1, Eigen::Vector2d(0, (seen.v - camera.lens.cy) / camera.lens.fy));
    add(lens + 2, Eigen::Vector2d::UnitX());
    add(lens + 3, Eigen::Vector2d::UnitY());
  }
  return linear;
}

std::vector<RigidTransform> first_guesses(const std::vector<Corner>& corners, const Calibration& calibration) {
  std::vector<std::size_t> count(calibration.cameras.size(), 0);
  for (const Corner& corner : corners) ++count[corner.camera];
  const auto most = static_cast<std::size_t>(std::ranges::max_element(count) - count.begin());
  const CalibratedCamera& camera = calibration.cameras[most];
  std::vector<cv::Point3d> board;
  std::vector<cv::Point2d> seen;
  for (const Corner& corner : corners) {
    if (corner.camera != most) continue;
    const Eigen::Vector2d direction = camera.lens.undistort(corner.pixel);
    board.emplace_back(corner.board_mm.x(), corner.board_mm.y(), 0);
    seen.emplace_back(direction.x(), direction.y());
  }
  std::vector<cv::Vec3d> turns, places;
  try {
    cv::solvePnPGeneric(board, seen, cv::Matx33d::eye(), cv::noArray(), turns, places, false, cv::SOLVEPNP_IPPE);
  } catch (const cv::Exception&) {
    return {};
  }
  std::vector<RigidTransform> guesses;
  for (std::size_t i = 0; i < turns.size(); ++i) {
    const Eigen::Vector3d turn(turns[i][0], turns[i][1], turns[i][2]);
    const RigidTransform camera_from_board{Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()).toRotationMatrix(),
                                           {places[i][0], places[i][1], places[i][2]}};
    guesses.push_back(camera.rig_from_camera.after(camera_from_board));
  }
  return guesses;
}

// Gauss and Newton's method, with Levenberg's damping where a step fails.
std::optional<LocatedBoard> refine(const std::vector<Corner>& corners, const Calibration& calibration,
                                   RigidTransform rig_from_board, const Eigen::Vector3d& middle_mm) {
  Linear now = linearise(corners, calibration, rig_from_board, middle_mm);
  if (!now.in_front) return std::nullopt;
  double damping = 0;
  for (int round = 0; round < kLocatingRounds; ++round) {
    Matrix6d damped = now.normal;
    damped.diagonal() *= 1 + damping;
    const Vector6d step = -damped.ldlt().solve(now.slope);
    const RigidTransform there = moved(rig_from_board, step, middle_mm);
    const Linear next = linearise(corners, calibration, there, middle_mm);
    if (!step.allFinite() || !next.in_front || next.squares_px2 > now.squares_px2) {
      damping = std::max(1e-6, 10 * damping);
      continue;
    }
    damping = damping > 1e-6 ? damping / 10 : 0;
    const bool settled = now.squares_px2 - next.squares_px2 <= kLocated * now.squares_px2;
    rig_from_board = there;
    now = next;
    if (settled) break;
  }
  const Eigen::SelfAdjointEigenSolver<Matrix6d> strengths(now.normal);
  if (strengths.eigenvalues()[0] < kWeakest * strengths.eigenvalues()[5]) return std::nullopt;
  LocatedBoard located;
  located.rig_from_board = rig_from_board;
  located.middle_mm = middle_mm;
  located.normal = now.normal;
  located.by_shared = -now.normal.ldlt().solve(now.by_shared);
  located.squares_px2 = now.squares_px2;
  located.corners = corners.size();
  return located;
}

}  // namespace

SharedErrors SharedErrors::of(const Calibration& calibration, double print_scale) {
  SharedErrors errors;
  errors.sigma = Eigen::VectorXd::Zero(1 + kLensTerms * static_cast<Eigen::Index>(calibration.cameras.size()));
  errors.sigma[kPrintScale] = print_scale;
  const auto& sigmas = calibration.report.camera_sigma;
  for (std::size_t i = 0; i < sigmas.size() && i < calibration.cameras.size(); ++i) {
    for (std::size_t term = 0; term < kLensTerms && term < sigmas[i].size(); ++term)
      errors.sigma[static_cast<Eigen::Index>(1 + kLensTerms * i + term)] = sigmas[i][term];
  }
  return errors;
}

Result<LocatedBoard> locate_board(std::span<const CameraSighting> sightings, const Board& board,
                                  const Calibration& calibration) {
  std::vector<Corner> corners;
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();
  for (const CameraSighting& each : sightings) {
    for (const SeenPoint& point : each.sighting.points) {
      corners.push_back({each.camera, point.pixel, board.point(point.id)});
      middle_mm += corners.back().board_mm;
    }
  }
  if (corners.size() < kCornersMin)
    return fail(ErrorCode::kNotFound, "too few corners of the board are visible: show at least six");
  middle_mm /= static_cast<double>(corners.size());
  std::optional<LocatedBoard> best;
  for (const RigidTransform& guess : first_guesses(corners, calibration)) {
    auto located = refine(corners, calibration, guess, middle_mm);
    if (located && (!best || located->squares_px2 < best->squares_px2)) best = std::move(located);
  }
  if (!best) return fail(ErrorCode::kNotFound, "the corners determine no place of the board: show more of it");
  return *best;
}

double corner_noise_px(std::span<const LocatedBoard> boards) {
  double squares = 0, freedom = 0;
  for (const LocatedBoard& each : boards) squares += each.squares_px2, freedom += each.degrees_of_freedom();
  return std::max(kCornerBiasPx, freedom > 0 ? std::sqrt(squares / freedom) : 0.0);
}

}  // namespace slsd
