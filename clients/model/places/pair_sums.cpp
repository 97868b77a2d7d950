// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/places/pair_sums.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "clients/model/places/visit_pairs.hpp"
#include "core/geometry/robust.hpp"

namespace slsd::model {
namespace {

/// Residuals beyond this many sigma lose their weight.
constexpr double kSigmas = 3;

class PairAdder {
 public:
  PairAdder(PairSums& sums, const PlacedShot& shot, const PlacedShot& reference, double motion_mm,
            const MotionScale& scale)
      : sums_(sums),
        object_from_reference_(reference.object_from_rig),
        own_rotation_(shot.object_from_rig.rotation),
        motion_mm_(motion_mm),
        scale_(scale) {}

  void add(const SurfaceCell& cell, const SurfaceCell& other, const Eigen::Vector3f& place) {
    const double off_mm = other.normal.dot(place - other.place_mm),
                 sigma_mm = std::hypot(cell.sigma_mm, other.sigma_mm);
    add_residual(place, other.normal, cell.normal, off_mm, sigma_mm);
    sums_.over_sigma.push_back(static_cast<float>(std::abs(off_mm) / sigma_mm));
  }
  void add(const SurfaceEdge& edge, const SurfaceEdge& other, const Eigen::Vector3f& place) {
    add_residual(place, other.across, edge.across, other.across.dot(place - other.place_mm),
                 std::hypot(edge.sigma_mm, other.sigma_mm));
  }

 private:
  /// @param direction, own_direction  of the residual, as the reference and the shot measured it, each in its rig's
  /// frame
  void add_residual(const Eigen::Vector3f& place, const Eigen::Vector3f& direction,
                    const Eigen::Vector3f& own_direction, double off_mm, double sigma_mm) {
    const Eigen::Vector3d arm = object_from_reference_ * place.cast<double>() - scale_.middle_mm;
    const Vector6 row = row_of(arm, object_from_reference_.rotation * direction.cast<double>());
    const Vector6 own_row = row_of(arm, own_rotation_ * own_direction.cast<double>());
    const double weight = robust_weight(off_mm, kSigmas * sigma_mm + motion_mm_) / (sigma_mm * sigma_mm);
    sums_.information.noalias() += weight * row * row.transpose();
    sums_.gradient += weight * off_mm * row;
    const Matrix6 both = 0.5 * (row * own_row.transpose() + own_row * row.transpose());
    sums_.relief_sum += both;
    sums_.sure_information += weight * both;
  }
  [[nodiscard]] Vector6 row_of(const Eigen::Vector3d& arm, const Eigen::Vector3d& direction) const {
    Vector6 row;
    row << arm.cross(direction) / scale_.size_mm, direction;
    return row;
  }

  PairSums& sums_;
  RigidTransform object_from_reference_;
  Eigen::Matrix3d own_rotation_;
  double motion_mm_;
  MotionScale scale_;
};

}  // namespace

RigidTransform moved(const RigidTransform& pose, const Vector6& by, const MotionScale& scale) {
  const Eigen::Vector3d turn = by.head<3>() / scale.size_mm;
  const double angle = turn.norm();
  const Eigen::Matrix3d rotation =
      angle > 0 ? Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix() : Eigen::Matrix3d::Identity();
  // Each product doubles what a rotation lacks in being one.
  return {Eigen::Quaterniond(rotation * pose.rotation).normalized().toRotationMatrix(),
          rotation * (pose.translation - scale.middle_mm) + scale.middle_mm + by.tail<3>()};
}

void PairSums::add_opposite(const PairSums& back) {
  information += back.information;
  gradient -= back.gradient;
  seen += back.seen;
  over_sigma.insert(over_sigma.end(), back.over_sigma.begin(), back.over_sigma.end());
  relief_sum += back.relief_sum, sure_information += back.sure_information;
}

void add_pairs(PairSums& sums, const PlacedShot& shot, const PlacedShot& reference, const Pairing& pairing,
               const MotionScale& scale) {
  const RigidTransform reference_from_rig = reference.object_from_rig.inverse().after(shot.object_from_rig);
  PairAdder adder(sums, shot, reference, pairing.motion_mm, scale);
  visit_pairs(*shot.shot, reference_from_rig, *reference.shot, pairing.level, pairing.gate_mm,
              [&](const SurfaceCell& cell, const SurfaceCell* other, const Eigen::Vector3f& place) {
                ++sums.seen;
                if (other) adder.add(cell, *other, place);
              });
  visit_edge_pairs(*shot.shot, reference_from_rig, *reference.shot, pairing.gate_mm,
                   [&](const SurfaceEdge& edge, const SurfaceEdge& other, const Eigen::Vector3f& place) {
                     adder.add(edge, other, place);
                   });
}

}  // namespace slsd::model
