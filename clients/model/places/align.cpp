// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/places/align.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "core/geometry/robust.hpp"

namespace slsd::model {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

struct Level {
  std::size_t level;
  float gate_mm;
  int rounds;
};
// A hand moves the surface by some pixels between two frames; the gate shrinks as the shots approach each other.
constexpr std::array kLevels{Level{0, 24, 12}, Level{1, 8, 8}, Level{2, 3, 10}};
/// Residuals beyond this many sigma lose their weight.
constexpr double kSigmas = 3;
/// Distances that the motion causes at first, beside those of the sigmas.
constexpr std::array kMotionMm{6.0, 1.5, 0.0};
constexpr std::size_t kFewestPairs = 60;

// Limits of a frame that fits, found on rendered busts: docs/model.md.
constexpr double kFewestOverlap = 0.3;
constexpr double kFewestAgreeing = 0.7;
constexpr double kGreatestFit = 2.5;
constexpr double kFewestDetermined = 0.002;

/// Sums of one Gauss-Newton step about the shot's middle, in mm: turns are scaled by the shot's size.
struct Step {
  Matrix6 information = Matrix6::Zero();
  Matrix6 shape = Matrix6::Zero();  // without sigmas
  Vector6 gradient = Vector6::Zero();
  std::size_t pairs = 0, seen = 0;
  std::vector<float> over_sigma;
};

double size_of(const Shot& shot, const Eigen::Vector3d& middle) {
  double sum = 0;
  for (const SurfaceView& view : shot.views)
    for (const SurfaceCell& cell : view.levels.back().cells)
      if (cell.sigma_mm > 0) sum += (cell.place_mm.cast<double>() - middle).squaredNorm();
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, shot.cells())));
}

class Aligner {
 public:
  Aligner(const Shot& shot, std::span<const PlacedShot> references)
      : shot_(shot), references_(references), middle_(shot.middle_mm()), size_mm_(size_of(shot, middle_)) {}

  [[nodiscard]] Step step_at(const RigidTransform& pose, const Level& at, double motion_mm) const {
    Step step;
    for (const PlacedShot& reference : references_) {
      const RigidTransform rig_from_object = reference.object_from_rig.inverse();
      const RigidTransform reference_from_rig = rig_from_object.after(pose);
      const Eigen::Vector3d middle = pose * middle_;
      visit_pairs(shot_, reference_from_rig, *reference.shot, at.level, at.gate_mm,
                  [&](const SurfaceCell& cell, const SurfaceCell* other, const Eigen::Vector3f& place) {
                    ++step.seen;
                    if (other) add(step, cell, *other, place, reference.object_from_rig, middle, motion_mm);
                  });
    }
    return step;
  }
  [[nodiscard]] RigidTransform moved(const RigidTransform& pose, const Vector6& by) const {
    const Eigen::Vector3d turn = by.head<3>() / size_mm_;
    const double angle = turn.norm();
    const Eigen::Matrix3d rotation =
        angle > 0 ? Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix() : Eigen::Matrix3d::Identity();
    const Eigen::Vector3d middle = pose * middle_;
    return {Eigen::Quaterniond(rotation * pose.rotation).normalized().toRotationMatrix(),
            rotation * (pose.translation - middle) + middle + by.tail<3>()};
  }
  [[nodiscard]] FreeMotion motion_of(const Vector6& by, const RigidTransform& pose) const {
    const Eigen::Vector3d turn = pose.rotation.transpose() * by.head<3>(),
                          shift = pose.rotation.transpose() * by.tail<3>();
    if (turn.norm() < 0.3 * shift.norm()) return {false, shift.normalized(), middle_};
    // The axis' point nearest to the middle: where the turn undoes the shift across it.
    const Eigen::Vector3d per_mm = turn / size_mm_;
    return {true, turn.normalized(), middle_ + per_mm.cross(shift) / per_mm.squaredNorm()};
  }

 private:
  static void add_sums(Step& step, const Vector6& row, double off_mm, double weight) {
    step.information.noalias() += weight * row * row.transpose();
    step.gradient += weight * off_mm * row;
  }
  void add(Step& step, const SurfaceCell& cell, const SurfaceCell& other, const Eigen::Vector3f& place,
           const RigidTransform& object_from_reference, const Eigen::Vector3d& middle, double motion_mm) const {
    const double off_mm = other.normal.dot(place - other.place_mm);
    const Eigen::Vector3d normal = object_from_reference.rotation * other.normal.cast<double>();
    const Eigen::Vector3d arm = object_from_reference * place.cast<double>() - middle;
    const double sigma2 = cell.sigma_mm * cell.sigma_mm + other.sigma_mm * other.sigma_mm;
    const double scale = kSigmas * std::sqrt(sigma2) + motion_mm;
    Vector6 row;
    row << arm.cross(normal) / size_mm_, normal;
    add_sums(step, row, off_mm, robust_weight(off_mm, scale) / sigma2);
    step.shape.noalias() += row * row.transpose();
    step.over_sigma.push_back(static_cast<float>(std::abs(off_mm) / std::sqrt(sigma2)));
    ++step.pairs;
  }

  const Shot& shot_;
  std::span<const PlacedShot> references_;
  Eigen::Vector3d middle_;
  double size_mm_;
};

}  // namespace

std::string to_string(const FreeMotion& motion) {
  const Eigen::Vector3d &axis = motion.axis, &through = motion.through_mm;
  const std::string along = fmt::format("({:.2f}, {:.2f}, {:.2f})", axis.x(), axis.y(), axis.z());
  if (!motion.turns) return "shifting along " + along;
  return fmt::format("turning about the axis {} through ({:.0f}, {:.0f}, {:.0f}) mm", along, through.x(), through.y(),
                     through.z());
}

bool fits(const Alignment& alignment) {
  return alignment.overlap >= kFewestOverlap && alignment.agreeing >= kFewestAgreeing && alignment.fit <= kGreatestFit;
}

std::string refusal_of(const Alignment& alignment) {
  if (alignment.determined < kFewestDetermined)
    return "the surface has too little relief to determine " + to_string(alignment.least_determined);
  if (alignment.overlap < kFewestOverlap)
    return fmt::format("only {:.0f} % of its points lie on the surface so far", 100 * alignment.overlap);
  if (alignment.agreeing < kFewestAgreeing || alignment.fit > kGreatestFit)
    return fmt::format("it does not fit: its typical distance is {:.1f} sigma, and {:.0f} % agree within three",
                       alignment.fit, 100 * alignment.agreeing);
  return {};
}

std::optional<Alignment> align(const Shot& shot, std::span<const PlacedShot> references, const RigidTransform& start,
                               std::size_t first) {
  constexpr double kStillMm = 0.001;
  const Aligner aligner(shot, references);
  RigidTransform pose = start;
  for (const Level& level : std::span(kLevels).subspan(first)) {
    for (int round = 0; round < level.rounds; ++round) {
      const Step step = aligner.step_at(pose, level, kMotionMm[level.level]);
      if (step.pairs < kFewestPairs >> (2 - level.level)) return std::nullopt;
      // A motion that nothing determines stays as it is.
      const Matrix6 damped = step.information + 1e-6 * step.information.trace() / 6 * Matrix6::Identity();
      const Vector6 by = -damped.ldlt().solve(step.gradient);
      pose = aligner.moved(pose, by);
      if (by.norm() < kStillMm) break;
    }
  }
  Step step = aligner.step_at(pose, kLevels.back(), 0);
  if (step.pairs < kFewestPairs) return std::nullopt;
  const double pairs = static_cast<double>(step.pairs);
  Alignment found;
  found.object_from_rig = pose;
  found.pairs = step.pairs, found.overlap = pairs / static_cast<double>(step.seen);
  found.agreeing =
      static_cast<double>(std::ranges::count_if(step.over_sigma, [](float off) { return off < kSigmas; })) / pairs;
  found.fit = kSigmaOfMedian * static_cast<double>(median_in_place(step.over_sigma));
  const Eigen::SelfAdjointEigenSolver<Matrix6> motions(step.shape / pairs);
  found.determined = motions.eigenvalues()[0];
  found.least_determined = aligner.motion_of(motions.eigenvectors().col(0), pose);
  return found;
}

}  // namespace slsd::model
