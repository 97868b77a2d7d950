// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/lens.hpp"

namespace slsd {

/// A rigid motion, b_from_a: point_in_b = rotation * point_in_a + translation. Millimetres.
struct RigidTransform {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  [[nodiscard]] Eigen::Vector3d operator*(const Eigen::Vector3d& point) const { return rotation * point + translation; }
  /// Composes c_from_a from c_from_b (this) and b_from_a.
  [[nodiscard]] RigidTransform after(const RigidTransform& b_from_a) const {
    return {rotation * b_from_a.rotation, rotation * b_from_a.translation + translation};
  }
  [[nodiscard]] RigidTransform inverse() const { return {rotation.transpose(), -(rotation.transpose() * translation)}; }
};

struct CalibratedCamera {
  std::string name;
  Lens lens;
  RigidTransform projector_from_camera;
  RigidTransform rig_from_camera;  ///< the identity for the first camera
};

/// Quality of a calibration; all fields are optional in the file.
struct CalibrationReport {
  std::optional<double> reprojection_error_camera_px;
  std::optional<double> reprojection_error_projector_px;
  std::optional<double> held_out_error_px;  ///< root mean square error of symbols in held-out poses, in the camera
  std::optional<std::string> verdict;       ///< "good", "usable" or "bad"
  /// One standard deviation of fx fy cx cy k1 k2 p1 p2 k3, 0 for a term that was not adjusted; 9, or empty.
  std::vector<double> projector_sigma;
  std::vector<std::vector<double>> camera_sigma;  ///< one for each camera, or empty
  std::optional<std::string> board;
  std::optional<std::string> date;
  std::optional<std::string> corrected;  ///< when and by what slsd --correct changed the calibration; empty: never
  std::optional<std::string> projector_serial;
  std::vector<std::string> camera_serials;  ///< one for each camera, or empty
  std::optional<double> epipolar_error_px;  ///< root mean square, in the projector
  /// One standard deviation of a depth at the middle of the field, from the calibration's own uncertainty, near to far.
  struct DepthSigma {
    double depth_mm = 0, sigma_mm = 0;
    friend bool operator==(const DepthSigma&, const DepthSigma&) = default;
  };
  std::vector<DepthSigma> depth_sigma;  ///< 3, or empty

  /// The same at any depth. It scales with the square of the depth between and beyond known depths; empty if none is
  /// known.
  [[nodiscard]] std::optional<double> depth_sigma_mm(double depth_mm) const;
};

struct Calibration {
  Lens projector;
  std::vector<CalibratedCamera> cameras;
  CalibrationReport report;

  /// The camera with this name; a single camera in the file matches any name.
  [[nodiscard]] const CalibratedCamera* camera(std::string_view name) const;
};

}  // namespace slsd
