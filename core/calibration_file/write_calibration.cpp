// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <string>

#include "core/calibration_file/calibration_file.hpp"
#include "core/calibration_file/yaml_writer.hpp"
#include "core/geometry/calibration.hpp"

namespace slsd {
namespace {

Eigen::Matrix3d pinhole(const Lens& lens) {
  Eigen::Matrix3d matrix;
  matrix << lens.fx, 0, lens.cx, 0, lens.fy, lens.cy, 0, 0, 1;
  return matrix;
}

Eigen::Matrix<double, 1, 5> distortion(const Lens& lens) {
  return Eigen::Map<const Eigen::Matrix<double, 1, 5>>(lens.distortion.data());
}

void write_sigma(YamlWriter& file, const char* key, const std::vector<double>& sigma) {
  if (sigma.empty()) return;
  file.write(key, Eigen::Map<const Eigen::RowVectorXd>(sigma.data(), static_cast<Eigen::Index>(sigma.size())));
}

void write_camera(YamlWriter& file, const Calibration& calibration, std::size_t index) {
  const CalibratedCamera& camera = calibration.cameras[index];
  const CalibrationReport& report = calibration.report;
  file.begin_map();
  file.write("name", camera.name);
  file.write("width", camera.lens.width_px);
  file.write("height", camera.lens.height_px);
  file.write("camera_matrix", pinhole(camera.lens));
  file.write("camera_distortion", distortion(camera.lens));
  file.write("R", camera.projector_from_camera.rotation);
  file.write("T", camera.projector_from_camera.translation);
  if (index > 0) {
    file.write("rig_from_camera_R", camera.rig_from_camera.rotation);
    file.write("rig_from_camera_T", camera.rig_from_camera.translation);
  }
  if (index < report.camera_sigma.size()) write_sigma(file, "camera_sigma", report.camera_sigma[index]);
  const bool has_serial = index < report.camera_serials.size() && !report.camera_serials[index].empty();
  if (has_serial) file.write("serial", report.camera_serials[index]);
  file.end_map();
}

void write_report(YamlWriter& file, const CalibrationReport& report) {
  file.write("reprojection_error_camera_px", report.reprojection_error_camera_px);
  file.write("reprojection_error_projector_px", report.reprojection_error_projector_px);
  file.write("epipolar_error_px", report.epipolar_error_px);
  file.write("held_out_error_px", report.held_out_error_px);
  if (!report.depth_sigma.empty()) {
    Eigen::RowVector3d depths, sigmas;
    for (Eigen::Index i = 0; i < 3; ++i) {
      const auto& [depth_mm, sigma_mm] = report.depth_sigma.at(static_cast<std::size_t>(i));
      depths(i) = depth_mm, sigmas(i) = sigma_mm;
    }
    file.write("depth_mm", depths);
    file.write("depth_sigma_mm", sigmas);
  }
  file.write("verdict", report.verdict);
  write_sigma(file, "projector_sigma", report.projector_sigma);
  file.write("board", report.board);
  file.write("date", report.date);
  file.write("corrected", report.corrected);
  file.write("projector_serial", report.projector_serial);
}

}  // namespace

std::string write_calibration(const Calibration& calibration) {
  YamlWriter file;
  file.write("projector_width", calibration.projector.width_px);
  file.write("projector_height", calibration.projector.height_px);
  file.write("projector_matrix", pinhole(calibration.projector));
  file.write("projector_distortion", distortion(calibration.projector));
  write_report(file, calibration.report);
  file.begin_sequence("cameras");
  for (std::size_t i = 0; i < calibration.cameras.size(); ++i) write_camera(file, calibration, i);
  file.end_sequence();
  return file.take();
}

}  // namespace slsd
