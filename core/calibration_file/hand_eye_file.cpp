// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibration_file/hand_eye_file.hpp"

#include "core/calibration_file/file_section.hpp"
#include "core/calibration_file/yaml_writer.hpp"

namespace slsd {
namespace {

constexpr std::size_t kMaxHandEyeBytes = 1 << 16;
constexpr double kOrthogonal = 1e-4;
constexpr double kMaxPlaceMm = 1e5;

struct MountKeys {
  const char *name, *rotation, *translation;
};

MountKeys keys_of(Mounted mounted) {
  return mounted == Mounted::kArm ? MountKeys{"arm", "flange_from_rig_R", "flange_from_rig_T"}
                                  : MountKeys{"cell", "base_from_rig_R", "base_from_rig_T"};
}

}  // namespace

Result<HandEyeCalibration> read_hand_eye(std::string_view text, std::string_view name) {
  const std::string where(name);
  if (text.size() > kMaxHandEyeBytes)
    return fail(ErrorCode::kMalformed, "is not a hand-eye file: it exceeds 64 KiB", where);
  const auto root = read_file_tree(text);
  if (!root) return fail(ErrorCode::kMalformed, root.error().message, where + ":" + std::to_string(root.error().line));
  FileSection section(*root, {}, where);
  HandEyeCalibration read;
  const std::string mounted = section.text("mounted");
  read.mounted = mounted == "cell" ? Mounted::kCell : Mounted::kArm;
  const MountKeys keys = keys_of(read.mounted);
  if (mounted != keys.name) section.refuse("mounted", "must be \"arm\" or \"cell\", as slsctl hand-eye writes it");
  read.mount_from_rig = {section.matrix3(keys.rotation), section.vector(keys.translation, 3)};
  const Eigen::Matrix3d& turn = read.mount_from_rig.rotation;
  const Eigen::Matrix3d defect = turn * turn.transpose() - Eigen::Matrix3d::Identity();
  if (!(defect.cwiseAbs().maxCoeff() < kOrthogonal && turn.determinant() > 0))
    section.refuse(keys.rotation, "is not a rotation");
  if (!(read.mount_from_rig.translation.cwiseAbs().maxCoeff() < kMaxPlaceMm))
    section.refuse(keys.translation, "is out of range");
  if (section.has("calibration_date")) read.calibration_date = section.text("calibration_date");
  if (section.has("verdict")) read.verdict = section.text("verdict");
  if (section.error()) return tl::unexpected(*section.error());
  return read;
}

std::string write_hand_eye(const HandEyeCalibration& hand_eye) {
  const MountKeys keys = keys_of(hand_eye.mounted);
  YamlWriter file;
  file.write("mounted", std::string(keys.name));
  file.write(keys.rotation, hand_eye.mount_from_rig.rotation);
  file.write(keys.translation, hand_eye.mount_from_rig.translation);
  if (!hand_eye.verdict.empty()) file.write("verdict", hand_eye.verdict);
  if (!hand_eye.calibration_date.empty()) file.write("calibration_date", hand_eye.calibration_date);
  if (hand_eye.poses == 0) return file.take();  // it was read from a file
  file.write("covariance", hand_eye.covariance);
  file.write("distance_mm", hand_eye.distance_mm);
  file.write("error_mm", hand_eye.error_mm);
  file.write("robot_place_sigma_mm", hand_eye.robot_place_mm);
  file.write("robot_turn_sigma_rad", hand_eye.robot_turn_rad);
  file.write("poses", hand_eye.poses);
  file.write("board", hand_eye.board);
  file.write("date", hand_eye.date);
  return file.take();
}

}  // namespace slsd
