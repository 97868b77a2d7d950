// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/places/adjust.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <ceres/ceres.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "core/geometry/robust.hpp"

namespace slsd::model {
namespace {

/// Frames whose orientations differ by more see too little of the same surface, from too different sides.
constexpr double kLinkDegrees = 40;
/// A link between frames this far apart in the path closes it.
constexpr std::size_t kFarApart = 8;
constexpr double kFewestLinkOverlap = 0.3;
constexpr std::size_t kFewestLinkPairs = 100;
constexpr float kLinkGateMm = 3;

struct Link {
  std::size_t a, b;
};

/// Both ways, so that neither shot's cells count for more.
PairSums sums_of(std::span<const ModelFrame> frames, const Link& link, const MotionScale& scale, double motion_mm,
                 float gate_mm = kLinkGateMm) {
  const PlacedShot a = frames[link.a].placed(), b = frames[link.b].placed();
  const Pairing pairing{.gate_mm = gate_mm, .motion_mm = motion_mm};
  PairSums there, back;
  add_pairs(there, a, b, pairing, scale);
  add_pairs(back, b, a, pairing, scale);
  there.add_opposite(back);
  return there;
}

MotionScale scale_of(std::span<const ModelFrame> frames) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const ModelFrame& frame : frames) sum += frame.object_from_rig * frame.shot.middle_mm();
  const Eigen::Vector3d middle = sum / static_cast<double>(frames.size());
  double squares = 0;
  for (const ModelFrame& frame : frames)
    squares += (frame.object_from_rig * frame.shot.middle_mm() - middle).squaredNorm();
  return {middle, std::max(10.0, std::sqrt(squares / static_cast<double>(frames.size())))};
}

std::vector<Link> links_of(std::span<const ModelFrame> frames, const MotionScale& scale) {
  std::vector<Link> links;
  for (std::size_t b = 1; b < frames.size(); ++b) {
    for (std::size_t a = 0; a < b; ++a) {
      if (turn_degrees(frames[a].object_from_rig, frames[b].object_from_rig) > kLinkDegrees) continue;
      const PairSums sums = sums_of(frames, {a, b}, scale, 0, 2 * kLinkGateMm);
      const std::size_t pairs = sums.pairs();
      if (pairs >= kFewestLinkPairs && static_cast<double>(pairs) > kFewestLinkOverlap * static_cast<double>(sums.seen))
        links.push_back({a, b});
    }
  }
  return links;
}

/// A link's quadratic form as six residuals: L^T (change of a - change of b) + L^-1 gradient.
struct LinkResidual {
  Matrix6 root;
  Vector6 offset;

  explicit LinkResidual(const PairSums& sums) {
    const Eigen::SelfAdjointEigenSolver<Matrix6> solver(sums.information);
    const Vector6 values = solver.eigenvalues().cwiseMax(1e-9 * solver.eigenvalues()[5]);
    root = values.cwiseSqrt().asDiagonal() * solver.eigenvectors().transpose();
    offset = values.cwiseSqrt().cwiseInverse().asDiagonal() * solver.eigenvectors().transpose() * sums.gradient;
  }
  template <class Number>
  bool operator()(const Number* a, const Number* b, Number* residuals) const {
    using Vector = Eigen::Matrix<Number, 6, 1>;
    const Vector change = Eigen::Map<const Vector>(a) - Eigen::Map<const Vector>(b);
    Eigen::Map<Vector>{residuals} = root.cast<Number>() * change + offset.cast<Number>();
    return true;
  }
};

/// Solves for all changes at once. @return the greatest change
double move_all(std::span<ModelFrame> frames, const std::vector<Link>& links, const MotionScale& scale,
                double motion_mm) {
  std::vector<Vector6> changes(frames.size(), Vector6::Zero());
  ceres::Problem problem;
  for (Vector6& change : changes) problem.AddParameterBlock(change.data(), 6);
  problem.SetParameterBlockConstant(changes.front().data());
  for (const Link& link : links)
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<LinkResidual, 6, 6, 6>(
                                 new LinkResidual(sums_of(frames, link, scale, motion_mm))),
                             nullptr, changes[link.a].data(), changes[link.b].data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = 10;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  double greatest = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    RigidTransform& pose = frames[i].object_from_rig;
    pose = moved(pose, changes[i], scale);
    greatest = std::max(greatest, changes[i].norm());
  }
  return greatest;
}

/// Distance between the places that two frames give to the surface of both: the move that lays one onto the other.
double apart_mm(std::span<const ModelFrame> frames, const std::vector<Link>& closing) {
  std::vector<double> moves;
  for (const Link& link : closing) {
    const PlacedShot reference = frames[link.a].placed();
    const ModelFrame& moved = frames[link.b];
    const auto found = align(moved.shot, {&reference, 1}, moved.object_from_rig);
    if (!found || !refusal_of(*found).empty()) continue;
    double squares = 0;
    std::size_t count = 0;
    for (const SurfaceView& view : moved.shot.views)
      for (const SurfaceCell& cell : view.levels.front().cells)
        if (cell.sigma_mm > 0) {
          const Eigen::Vector3d place = cell.place_mm.cast<double>();
          squares += (found->object_from_rig * place - moved.object_from_rig * place).squaredNorm(), ++count;
        }
    if (count > 0) moves.push_back(std::sqrt(squares / static_cast<double>(count)));
  }
  return median_of(moves);
}

}  // namespace

bool came_round(std::span<const ModelFrame> frames, std::size_t early, std::size_t late) {
  return late - early >= std::max(kFarApart, frames.size() / 2) &&
         turn_degrees(frames[early].object_from_rig, frames[late].object_from_rig) < 15;
}

Adjustment adjust(std::span<ModelFrame> frames) {
  Adjustment done;
  if (frames.empty()) return done;
  const MotionScale scale = scale_of(frames);
  std::vector<Link> links = links_of(frames, scale);
  std::vector<Link> closing;
  for (const Link& link : links)
    if (came_round(frames, link.a, link.b)) closing.push_back(link);
  done.links = links.size(), done.closed = !closing.empty();
  done.drift_mm = apart_mm(frames, closing);
  for (const double motion_mm : {1.0, 1.0, 0.3, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0})
    if (move_all(frames, links, scale, motion_mm) < 0.001 && motion_mm == 0) break;
  done.seam_mm = apart_mm(frames, closing);
  std::vector<std::vector<float>> by_frame(frames.size());
  std::vector<float> all;
  for (const Link& link : links) {
    const PairSums sums = sums_of(frames, link, scale, 0);
    for (auto* to : {&all, &by_frame[link.a], &by_frame[link.b]})
      to->insert(to->end(), sums.over_sigma.begin(), sums.over_sigma.end());
  }
  done.over_sigma = kSigmaOfMedian * static_cast<double>(median_in_place(all));
  for (std::vector<float>& of_frame : by_frame) {
    if (of_frame.empty()) {
      done.fit.emplace_back();
    } else {
      done.fit.emplace_back(kSigmaOfMedian * static_cast<double>(median_in_place(of_frame)));
    }
  }
  return done;
}

}  // namespace slsd::model
