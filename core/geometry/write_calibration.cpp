// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <opencv2/core/persistence.hpp>

#include "core/geometry/calibration.hpp"

namespace slsd {
namespace {

void write_matrix(cv::FileStorage& storage, const char* key, const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  cv::Mat_<double> copy(static_cast<int>(matrix.rows()), static_cast<int>(matrix.cols()));
  for (int row = 0; row < copy.rows; ++row) {
    for (int column = 0; column < copy.cols; ++column) copy(row, column) = matrix(row, column);
  }
  storage << key << copy;
}

Eigen::Matrix3d pinhole(const Lens& lens) {
  Eigen::Matrix3d matrix;
  matrix << lens.fx, 0, lens.cx, 0, lens.fy, lens.cy, 0, 0, 1;
  return matrix;
}

Eigen::Matrix<double, 1, 5> distortion(const Lens& lens) {
  return Eigen::Map<const Eigen::Matrix<double, 1, 5>>(lens.distortion.data());
}

template <class T>
void write_optional(cv::FileStorage& storage, const char* key, const std::optional<T>& value) {
  if (value) storage << key << *value;
}

void write_sigma(cv::FileStorage& storage, const char* key, const std::vector<double>& sigma) {
  if (sigma.empty()) return;
  write_matrix(storage, key,
               Eigen::Map<const Eigen::RowVectorXd>(sigma.data(), static_cast<Eigen::Index>(sigma.size())));
}

void write_camera(cv::FileStorage& storage, const Calibration& calibration, std::size_t index) {
  const CalibratedCamera& camera = calibration.cameras[index];
  const CalibrationReport& report = calibration.report;
  storage << "{"
          << "name" << camera.name << "width" << camera.lens.width_px << "height" << camera.lens.height_px;
  write_matrix(storage, "camera_matrix", pinhole(camera.lens));
  write_matrix(storage, "camera_distortion", distortion(camera.lens));
  write_matrix(storage, "R", camera.projector_from_camera.rotation);
  write_matrix(storage, "T", camera.projector_from_camera.translation);
  if (index > 0) {
    write_matrix(storage, "rig_from_camera_R", camera.rig_from_camera.rotation);
    write_matrix(storage, "rig_from_camera_T", camera.rig_from_camera.translation);
  }
  if (index < report.camera_sigma.size()) write_sigma(storage, "camera_sigma", report.camera_sigma[index]);
  const bool has_serial = index < report.camera_serials.size() && !report.camera_serials[index].empty();
  if (has_serial) storage << "serial" << report.camera_serials[index];
  storage << "}";
}

void write_report(cv::FileStorage& storage, const CalibrationReport& report) {
  write_optional(storage, "reprojection_error_camera_px", report.reprojection_error_camera_px);
  write_optional(storage, "reprojection_error_projector_px", report.reprojection_error_projector_px);
  write_optional(storage, "epipolar_error_px", report.epipolar_error_px);
  write_optional(storage, "held_out_error_px", report.held_out_error_px);
  if (!report.depth_sigma.empty()) {
    Eigen::RowVector3d depths, sigmas;
    for (Eigen::Index i = 0; i < 3; ++i) {
      const auto& [depth_mm, sigma_mm] = report.depth_sigma.at(static_cast<std::size_t>(i));
      depths(i) = depth_mm, sigmas(i) = sigma_mm;
    }
    write_matrix(storage, "depth_mm", depths);
    write_matrix(storage, "depth_sigma_mm", sigmas);
  }
  write_optional(storage, "verdict", report.verdict);
  write_sigma(storage, "projector_sigma", report.projector_sigma);
  write_optional(storage, "board", report.board);
  write_optional(storage, "date", report.date);
  write_optional(storage, "projector_serial", report.projector_serial);
}

}  // namespace

std::string write_calibration(const Calibration& calibration) {
  cv::FileStorage storage(".yml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY | cv::FileStorage::FORMAT_YAML);
  storage << "projector_width" << calibration.projector.width_px;
  storage << "projector_height" << calibration.projector.height_px;
  write_matrix(storage, "projector_matrix", pinhole(calibration.projector));
  write_matrix(storage, "projector_distortion", distortion(calibration.projector));
  write_report(storage, calibration.report);
  storage << "cameras"
          << "[";
  for (std::size_t i = 0; i < calibration.cameras.size(); ++i) write_camera(storage, calibration, i);
  storage << "]";
  return storage.releaseAndGetString();
}

}  // namespace slsd
