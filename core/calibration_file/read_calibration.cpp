// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <set>

#include <Eigen/Geometry>

#include "core/calibration_file/calibration_file.hpp"
#include "core/calibration_file/file_section.hpp"
#include "core/calibration_file/file_tree.hpp"
#include "core/geometry/calibration.hpp"
#include "core/image_size.hpp"

namespace slsd {
namespace {

constexpr std::size_t kMaxFileSize = 1 << 20;
constexpr std::size_t kMaxCameras = 64;
constexpr double kMaxLength = 1e7;  // for a focal length in px or a translation in mm
constexpr double kMinBaselineMm = 1e-3;
constexpr double kRotationTolerance = 1e-4;

void read_pinhole(FileSection& section, const char* key, Lens& lens) {
  const Eigen::Matrix3d matrix = section.matrix3(key);
  if (!(matrix(0, 0) > 0 && matrix(1, 1) > 0 && matrix(0, 0) < kMaxLength && matrix(1, 1) < kMaxLength)) {
    section.refuse(key, "must have positive focal lengths, in pixels: x points to the right, y down and z forward");
  }
  if (matrix(0, 1) != 0 || matrix(1, 0) != 0) section.refuse(key, "must have no skew");
  if (matrix.row(2) != Eigen::RowVector3d(0, 0, 1)) section.refuse(key, "must have 0 0 1 as its last row");
  if (matrix.col(2).cwiseAbs().maxCoeff() > kMaxLength) section.refuse(key, "has its principal point far outside");
  lens.fx = matrix(0, 0);
  lens.fy = matrix(1, 1);
  lens.cx = matrix(0, 2);
  lens.cy = matrix(1, 2);
}

struct LensKeys {
  const char* width;
  const char* height;
  const char* matrix;
  const char* distortion;
};
constexpr LensKeys kProjectorKeys{"projector_width", "projector_height", "projector_matrix", "projector_distortion"};
constexpr LensKeys kCameraKeys{"width", "height", "camera_matrix", "camera_distortion"};

Lens read_lens(FileSection& section, const LensKeys& keys) {
  Lens lens;
  lens.width_px = section.whole(keys.width, 1, kMaxImageSidePx);
  lens.height_px = section.whole(keys.height, 1, kMaxImageSidePx);
  if (!section.error() && !is_readable_size(lens.width_px, lens.height_px)) {
    section.refuse(keys.height, "times " + std::string(keys.width) + " must be at most " + std::to_string(kMaxImagePx) +
                                    " pixels; have the camera bin or crop its images, and calibrate with those");
  }
  read_pinhole(section, keys.matrix, lens);
  Eigen::Map<Eigen::Matrix<double, 5, 1>>(lens.distortion.data()) =
      section.vector(keys.distortion, 5,
                     "slsd reads OpenCV's k1 k2 p1 p2 k3, not a fisheye, rational, thin prism or tilted model; slsd "
                     "--calibrate writes such a calibration");
  if (!section.error() && !lens.invertible()) {
    section.refuse(keys.distortion,
                   "cannot be inverted over the whole image; calibrate again, with views in the corners");
  }
  return lens;
}

RigidTransform read_motion(FileSection& section, const char* rotation_key, const char* translation_key) {
  RigidTransform motion{section.matrix3(rotation_key), section.vector(translation_key, 3)};
  const Eigen::Matrix3d defect = motion.rotation * motion.rotation.transpose() - Eigen::Matrix3d::Identity();
  if (!(defect.cwiseAbs().maxCoeff() < kRotationTolerance && motion.rotation.determinant() > 0)) {
    const bool mirrors = motion.rotation.determinant() < 0;
    section.refuse(rotation_key, mirrors ? "is not a rotation but mirrors: one of its axes has the wrong sign"
                                         : "is not a rotation: its columns must be unit vectors at right angles");
  }
  if (!(motion.translation.cwiseAbs().maxCoeff() < kMaxLength)) section.refuse(translation_key, "is out of range");
  return motion;
}

RigidTransform read_rig_motion(FileSection& section, bool first) {
  const char* const rotation_key = "rig_from_camera_R";
  const char* const translation_key = "rig_from_camera_T";
  if (first && !section.has(rotation_key) && !section.has(translation_key)) return {};
  RigidTransform motion = read_motion(section, rotation_key, translation_key);
  if (first && (!motion.rotation.isIdentity(kRotationTolerance) || motion.translation.norm() > kMinBaselineMm)) {
    section.refuse(rotation_key, "must be the identity for the first camera: its frame is the rig's");
  }
  return motion;
}

CalibratedCamera read_camera(FileSection& section, std::size_t index) {
  const std::string place = "cameras[" + std::to_string(index) + "]";
  section.set_path(place + ".");
  CalibratedCamera camera;
  camera.name = section.text("name");
  section.set_path(place + " (" + camera.name + "): ");
  camera.lens = read_lens(section, kCameraKeys);
  camera.projector_from_camera = read_motion(section, "R", "T");
  if (camera.projector_from_camera.translation.norm() < kMinBaselineMm) {
    section.refuse("T", "is zero: without a distance between camera and projector there is no depth");
  }
  camera.rig_from_camera = read_rig_motion(section, index == 0);
  return camera;
}

std::vector<double> read_sigma(FileSection& section, const char* key) {
  if (!section.has(key)) return {};
  const Eigen::VectorXd sigma = section.vector(key, 9);
  return {sigma.begin(), sigma.end()};
}

std::vector<CalibrationReport::DepthSigma> read_depth_sigma(FileSection& section) {
  if (!section.has("depth_mm")) return {};
  const Eigen::VectorXd depths = section.vector("depth_mm", 3), sigmas = section.vector("depth_sigma_mm", 3);
  std::vector<CalibrationReport::DepthSigma> out;
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (depths(i) <= (i == 0 ? 0 : depths(i - 1))) section.refuse("depth_mm", "must increase, from above 0");
    if (sigmas(i) < 0) section.refuse("depth_sigma_mm", "must not be negative");
    out.push_back({depths(i), sigmas(i)});
  }
  return out;
}

CalibrationReport read_report(FileSection& section) {
  CalibrationReport report;
  if (section.has("reprojection_error_camera_px")) {
    report.reprojection_error_camera_px = section.number("reprojection_error_camera_px");
  }
  if (section.has("reprojection_error_projector_px")) {
    report.reprojection_error_projector_px = section.number("reprojection_error_projector_px");
  }
  if (section.has("epipolar_error_px")) report.epipolar_error_px = section.number("epipolar_error_px");
  if (section.has("held_out_error_px")) report.held_out_error_px = section.number("held_out_error_px");
  report.depth_sigma = read_depth_sigma(section);
  if (section.has("verdict")) report.verdict = section.text("verdict");
  report.projector_sigma = read_sigma(section, "projector_sigma");
  if (section.has("board")) report.board = section.text("board");
  if (section.has("date")) report.date = section.text("date");
  if (section.has("corrected")) report.corrected = section.text("corrected");
  if (section.has("projector_serial")) report.projector_serial = section.text("projector_serial");
  return report;
}

std::optional<Error> read_cameras(const std::vector<FileNode>& items, std::string_view name, Calibration& calibration) {
  std::set<std::string> names;
  std::vector<std::string> serials;
  std::vector<std::vector<double>> sigmas;
  for (const FileNode& node : items) {
    FileSection section(node, {}, std::string(name));
    CalibratedCamera camera = read_camera(section, calibration.cameras.size());
    if (!names.insert(camera.name).second) section.refuse("name", "is already another camera's name");
    serials.push_back(section.has("serial") ? section.text("serial") : std::string());
    sigmas.push_back(read_sigma(section, "camera_sigma"));
    if (section.error()) return section.error();
    calibration.cameras.push_back(std::move(camera));
  }
  const bool any = std::any_of(serials.begin(), serials.end(), [](const auto& serial) { return !serial.empty(); });
  if (any) calibration.report.camera_serials = std::move(serials);
  const bool any_sigma = std::ranges::any_of(sigmas, [](const auto& sigma) { return !sigma.empty(); });
  if (any_sigma) calibration.report.camera_sigma = std::move(sigmas);
  return std::nullopt;
}

/// Names the other kind of calibration file that this is, and what to do; empty if it is no known kind.
std::string other_kind(const FileNode& root) {
  constexpr const char* kWanted =
      ": slsd reads one calibration of camera and projector together, in OpenCV's YAML with k1 k2 p1 p2 k3, as slsd "
      "--calibrate writes it";
  const bool is_ours = root.find("projector_width") != nullptr || root.find("cameras") != nullptr;
  if (is_ours) return {};
  if (root.kind != FileNode::Kind::kMap) return std::string("is not a calibration file") + kWanted;
  const auto has = [&](const char* key) { return root.find(key) != nullptr; };
  if (has("cam0") || has("cam1")) return std::string("is a calibration of Kalibr") + kWanted;
  if (has("image_width") && (has("distortion_model") || has("camera_name") || has("projection_matrix"))) {
    return std::string("is a camera_info file of ROS, for a camera without a projector") + kWanted;
  }
  const bool of_opencv = has("camera_matrix") || has("cameraMatrix") || has("K") || has("M1") || has("K1") ||
                         has("distortion_coefficients") || has("distCoeffs") || has("D1");
  return of_opencv ? std::string("is a calibration of cameras without a projector") + kWanted : std::string();
}

/// Names the syntax of a file that is not YAML, by its first character; null if it may be YAML.
const char* other_syntax(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n\xef\xbb\xbf");
  if (first == text.npos) return "nothing";
  if (text[first] == '<') return "XML";
  return text[first] == '{' ? "JSON" : nullptr;
}

Result<Calibration> read_root(const FileNode& root, std::string_view name) {
  if (const std::string kind = other_kind(root); !kind.empty()) {
    return fail(ErrorCode::kMalformed, kind, std::string(name));
  }
  FileSection section(root, {}, std::string(name));
  Calibration calibration;
  calibration.projector = read_lens(section, kProjectorKeys);
  calibration.report = read_report(section);
  const FileNode* const cameras = root.find("cameras");
  const std::size_t count = cameras != nullptr ? cameras->items.size() : 0;
  if (count < 1 || count > kMaxCameras) {
    section.refuse("cameras", "must be a sequence of 1 to " + std::to_string(kMaxCameras) + " maps");
  }
  if (section.error()) return tl::unexpected(*section.error());
  if (auto error = read_cameras(cameras->items, name, calibration)) return tl::unexpected(*error);
  return calibration;
}

}  // namespace

Result<Calibration> read_calibration(std::string_view text, std::string_view name) {
  const std::string where(name);
  if (text.size() > kMaxFileSize)
    return fail(ErrorCode::kMalformed, "is not a calibration file: it exceeds 1 MiB", where);
  if (const char* const what = other_syntax(text)) {
    return fail(ErrorCode::kMalformed,
                std::string("holds ") + what + ": slsd reads OpenCV's YAML, as slsd --calibrate writes it", where);
  }
  const auto root = read_file_tree(text);
  if (!root) return fail(ErrorCode::kMalformed, root.error().message, where + ":" + std::to_string(root.error().line));
  return read_root(*root, name);
}

}  // namespace slsd
