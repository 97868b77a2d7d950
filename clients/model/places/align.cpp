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

struct Level {
  std::size_t level;
  float gate_mm;
  int rounds;
};
// A hand moves the surface by some pixels between two frames; the gate shrinks as the shots approach each other.
constexpr std::array kLevels{Level{0, 24, 12}, Level{1, 8, 8}, Level{2, 3, 10}};
/// Pairs within so many sigma agree.
constexpr float kAgreeSigmas = 3;
/// Distances that the motion causes at first, beside those of the sigmas.
constexpr std::array kMotionMm{6.0, 1.5, 0.0};
constexpr std::size_t kFewestPairs = 60;

// Limits of a frame that fits, found on rendered busts: docs/model.md.
constexpr double kFewestOverlap = 0.3;
constexpr double kFewestAgreeing = 0.7;
constexpr double kGreatestFit = 2.5;
constexpr double kFewestDetermined = 0.002;
constexpr double kMostUncertainPx = 2.4;
/// Errors of neighbouring cells are alike: so many count as one, squared.
constexpr double kErrorsAlike = 3;
constexpr double kLeastInformation = 1e-6;

/// Width of a pixel of the first camera at the shot's middle, mm.
double pixel_mm(const Shot& shot) {
  const RangeImage& image = shot.views.front().image;
  return (image.camera_from_rig * shot.middle_mm()).z() / image.lens.fx;
}

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

  [[nodiscard]] PairSums sums_at(const RigidTransform& pose, const Level& at, double motion_mm) const {
    PairSums sums;
    for (const PlacedShot& reference : references_)
      add_pairs(sums, {&shot_, pose}, reference, {at.level, at.gate_mm, motion_mm}, scale_at(pose));
    return sums;
  }
  [[nodiscard]] MotionScale scale_at(const RigidTransform& pose) const { return {pose * middle_, size_mm_}; }
  [[nodiscard]] FreeMotion motion_of(const Vector6& by, const RigidTransform& pose) const {
    const Eigen::Vector3d turn = pose.rotation.transpose() * by.head<3>(),
                          shift = pose.rotation.transpose() * by.tail<3>();
    if (turn.norm() < 0.3 * shift.norm()) return {false, shift.normalized(), middle_};
    // The axis' point nearest to the middle: where the turn undoes the shift across it.
    const Eigen::Vector3d per_mm = turn / size_mm_;
    return {true, turn.normalized(), middle_ + per_mm.cross(shift) / per_mm.squaredNorm()};
  }

 private:
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
  if (alignment.determined < kFewestDetermined || alignment.uncertain_px > kMostUncertainPx)
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
      const PairSums sums = aligner.sums_at(pose, level, kMotionMm[level.level]);
      if (sums.pairs() < kFewestPairs >> (2 - level.level)) return std::nullopt;
      // A motion that nothing determines stays as it is.
      const Matrix6 damped = sums.information + 1e-6 * sums.information.trace() / 6 * Matrix6::Identity();
      const Vector6 by = -damped.ldlt().solve(sums.gradient);
      pose = moved(pose, by, aligner.scale_at(pose));
      if (by.norm() < kStillMm) break;
    }
  }
  PairSums sums = aligner.sums_at(pose, kLevels.back(), 0);
  if (sums.pairs() < kFewestPairs) return std::nullopt;
  const double pairs = static_cast<double>(sums.pairs());
  Alignment found;
  found.object_from_rig = pose;
  found.pairs = sums.pairs(), found.overlap = pairs / static_cast<double>(sums.seen);
  found.agreeing =
      static_cast<double>(std::ranges::count_if(sums.over_sigma, [](float off) { return off < kAgreeSigmas; })) / pairs;
  const Eigen::SelfAdjointEigenSolver<Matrix6> motions(sums.relief());
  found.determined = motions.eigenvalues()[0];
  found.least_determined = aligner.motion_of(motions.eigenvectors().col(0), pose);
  const Eigen::SelfAdjointEigenSolver<Matrix6> certain(sums.sure_information, Eigen::EigenvaluesOnly);
  found.uncertain_px = kErrorsAlike / std::sqrt(std::max(kLeastInformation, certain.eigenvalues()[0])) / pixel_mm(shot);
  found.fit = kSigmaOfMedian * static_cast<double>(median_in_place(sums.over_sigma));
  return found;
}

}  // namespace slsd::model
