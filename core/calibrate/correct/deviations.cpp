// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/correct/deviations.hpp"

#include <cmath>
#include <optional>

#include "core/geometry/triangulate.hpp"

namespace slsd {
namespace {

constexpr int kDirectionsAcross = 8, kDirectionsDown = 6;
/// An explanation that is less likely by this factor does not count (logarithm).
constexpr double kUnlikely = 12;

struct SharedPoint {
  std::size_t camera;
  Match match;
};

Calibration as_calibration(const RigModel& rig) {
  return rig.calibration(std::vector<NamedCamera>(rig.cameras.size()));
}

std::vector<SharedPoint> shared_points(double depth_mm, const Calibration& rig) {
  std::vector<SharedPoint> points;
  for (std::size_t camera = 0; camera < rig.cameras.size(); ++camera) {
    const CalibratedCamera& eye = rig.cameras[camera];
    for (int i = 0; i < kDirectionsAcross * kDirectionsDown; ++i) {
      const Eigen::Vector2d pixel((i % kDirectionsAcross + 0.5) / kDirectionsAcross * eye.lens.width_px - 0.5,
                                  (i / kDirectionsAcross + 0.5) / kDirectionsDown * eye.lens.height_px - 0.5);
      const Eigen::Vector3d point = eye.projector_from_camera * (depth_mm * eye.lens.undistort(pixel).homogeneous());
      if (!(point.z() > 0)) continue;
      const Eigen::Vector2d lit = rig.projector.project(point);
      const bool within =
          lit.x() >= 0 && lit.y() >= 0 && lit.x() < rig.projector.width_px && lit.y() < rig.projector.height_px;
      if (within) points.push_back({camera, {pixel, lit}});
    }
  }
  return points;
}

using Points = Eigen::Matrix3Xd;

/// Points in the rig's frame.
Points measured(const std::vector<SharedPoint>& points, const Calibration& rig) {
  Points out(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const CalibratedCamera& camera = rig.cameras[points[i].camera];
    out.col(static_cast<Eigen::Index>(i)) =
        camera.rig_from_camera * triangulate(points[i].match, camera, rig.projector, 1).point_in_camera;
  }
  return out;
}

double mean_square(const Points& off) {
  return off.squaredNorm() / static_cast<double>(off.cols());
}

/// Mean variance of the points from the covariance of the drift.
double variance_of(const std::vector<SharedPoint>& points, const RigModel& calibrated, const DriftFit& fit,
                   const Points& at) {
  const Eigen::Index count = fit.by.size();
  if (count == 0) return 0;
  Eigen::MatrixXd slopes(3 * at.cols(), count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const double step = 1e-2 * std::sqrt(fit.covariance(i, i));
    Eigen::VectorXd more = fit.by;
    more(i) += step;
    const Points moved = measured(points, as_calibration(drifted(calibrated, fit.explanation, more)));
    slopes.col(i) = (moved - at).reshaped() / step;
  }
  return (slopes * fit.covariance).cwiseProduct(slopes).sum() / static_cast<double>(at.cols());
}

}  // namespace

std::vector<DeviationAt> deviations_at(const std::vector<double>& depths_mm, const RigModel& calibrated,
                                       const std::vector<DriftFit>& fits, std::size_t best) {
  const Calibration before = as_calibration(calibrated), after = as_calibration(fits[best].rig);
  std::vector<DeviationAt> out;
  for (const double depth_mm : depths_mm) {
    const std::vector<SharedPoint> points = shared_points(depth_mm, after);
    if (points.empty()) continue;
    const Points corrected = measured(points, after);
    double sum = 0, weights = 0;
    for (const DriftFit& fit : fits) {
      const double less_likely = fits[best].log_evidence - fit.log_evidence;
      if (less_likely > kUnlikely) continue;
      const Points at = measured(points, as_calibration(fit.rig));
      const double weight = std::exp(-less_likely);
      sum += weight * (variance_of(points, calibrated, fit, at) + mean_square(at - corrected)), weights += weight;
    }
    out.push_back({depth_mm, std::sqrt(mean_square(measured(points, before) - corrected)), std::sqrt(sum / weights)});
  }
  return out;
}

}  // namespace slsd
