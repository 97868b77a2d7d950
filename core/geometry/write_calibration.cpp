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

void write_camera(cv::FileStorage& storage, const CalibratedCamera& camera, const std::string& serial, bool first) {
  storage << "{"
          << "name" << camera.name << "width" << camera.lens.width_px << "height" << camera.lens.height_px;
  write_matrix(storage, "camera_matrix", pinhole(camera.lens));
  write_matrix(storage, "camera_distortion", distortion(camera.lens));
  write_matrix(storage, "R", camera.projector_from_camera.rotation);
  write_matrix(storage, "T", camera.projector_from_camera.translation);
  if (!first) {
    write_matrix(storage, "rig_from_camera_R", camera.rig_from_camera.rotation);
    write_matrix(storage, "rig_from_camera_T", camera.rig_from_camera.translation);
  }
  if (!serial.empty()) storage << "serial" << serial;
  storage << "}";
}

void write_report(cv::FileStorage& storage, const CalibrationReport& report) {
  write_optional(storage, "reprojection_error_camera_px", report.reprojection_error_camera_px);
  write_optional(storage, "reprojection_error_projector_px", report.reprojection_error_projector_px);
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
  for (std::size_t i = 0; i < calibration.cameras.size(); ++i) {
    const auto& serials = calibration.report.camera_serials;
    write_camera(storage, calibration.cameras[i], i < serials.size() ? serials[i] : std::string(), i == 0);
  }
  storage << "]";
  return storage.releaseAndGetString();
}

}  // namespace slsd
