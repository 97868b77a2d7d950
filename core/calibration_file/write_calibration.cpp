// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>

#include "core/calibration_file/calibration_file.hpp"
#include "core/geometry/calibration.hpp"

namespace slsd {
namespace {

constexpr std::size_t kLineLength = 80;

// As OpenCV reads them: only a decimal point distinguishes a real number from an integer.
std::string number_text(double value) {
  if (std::isnan(value)) return ".Nan";
  if (std::isinf(value)) return value < 0 ? "-.Inf" : ".Inf";
  std::array<char, 32> text{};
  const auto format =
      value == std::floor(value) && std::abs(value) < 1e9 ? std::chars_format::fixed : std::chars_format::scientific;
  const bool whole = format == std::chars_format::fixed;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value, format, whole ? 0 : 16).ptr;
  return std::string(text.data(), end) + (whole ? "." : "");
}

// Writes OpenCV's YAML, line by line.
class Writer {
 public:
  void begin_sequence(const char* key) { line(std::string(key) + ":"), indent_ += 3; }
  void end_sequence() { indent_ -= 3; }
  void begin_map() { line("-"), indent_ += 3; }
  void end_map() { indent_ -= 3; }

  void write(const char* key, int value) { line(std::string(key) + ": " + std::to_string(value)); }
  void write(const char* key, double value) { line(std::string(key) + ": " + number_text(value)); }
  void write(const char* key, const std::string& value) {
    std::string quoted;
    for (const char letter : value) (quoted += letter == '"' || letter == '\\' ? "\\" : "") += letter;
    line(std::string(key) + ": \"" + quoted + "\"");
  }
  void write(const char* key, const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
    line(std::string(key) + ": !!opencv-matrix");
    indent_ += 3;
    line("rows: " + std::to_string(matrix.rows()));
    line("cols: " + std::to_string(matrix.cols()));
    line("dt: d");
    std::string numbers = "data: [";
    for (Eigen::Index i = 0; i < matrix.size(); ++i) {
      const std::string number = std::string(" ").append(number_text(matrix(i / matrix.cols(), i % matrix.cols())));
      if (indent_ + numbers.size() + number.size() >= kLineLength) {
        line(numbers);
        numbers = "   ";
      }
      numbers += number + (i + 1 < matrix.size() ? "," : " ]");
    }
    line(numbers);
    indent_ -= 3;
  }
  template <class T>
  void write(const char* key, const std::optional<T>& value) {
    if (value) write(key, *value);
  }
  [[nodiscard]] std::string take() { return std::move(text_); }

 private:
  void line(const std::string& words) { text_ += std::string(indent_, ' ') + words + "\n"; }

  std::string text_ = "%YAML:1.0\n---\n";
  std::size_t indent_ = 0;
};

Eigen::Matrix3d pinhole(const Lens& lens) {
  Eigen::Matrix3d matrix;
  matrix << lens.fx, 0, lens.cx, 0, lens.fy, lens.cy, 0, 0, 1;
  return matrix;
}

Eigen::Matrix<double, 1, 5> distortion(const Lens& lens) {
  return Eigen::Map<const Eigen::Matrix<double, 1, 5>>(lens.distortion.data());
}

void write_sigma(Writer& file, const char* key, const std::vector<double>& sigma) {
  if (sigma.empty()) return;
  file.write(key, Eigen::Map<const Eigen::RowVectorXd>(sigma.data(), static_cast<Eigen::Index>(sigma.size())));
}

void write_camera(Writer& file, const Calibration& calibration, std::size_t index) {
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

void write_report(Writer& file, const CalibrationReport& report) {
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
  file.write("projector_serial", report.projector_serial);
}

}  // namespace

std::string write_calibration(const Calibration& calibration) {
  Writer file;
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
