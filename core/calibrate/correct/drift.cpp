// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/correct/drift.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace slsd {
namespace {

using Kind = DriftParameter::Kind;

constexpr double kDegrees = 180 / std::numbers::pi;
// One standard deviation of what screws, mounts and warmth do to a rig.
constexpr double kTurnDeg = 0.2, kShiftMm = 1, kShiftOfBaseline = 0.005, kFocus = 0.005;
// Paper shrinks by less than a tenth of this; "fit to page" scales by more.
constexpr double kPrint = 0.02;

void add_axes(Explanation& to, Kind kind, int device) {
  for (int axis = 0; axis < 3; ++axis) to.push_back({kind, device, axis});
}

Explanation joined(const Explanation& one, const Explanation& other) {
  Explanation both = one;
  both.insert(both.end(), other.begin(), other.end());
  return both;
}

struct DeviceDrift {
  MotionVector motion{};
  double farther_mm = 0, focus = 0;
};

DeviceModel& device_of(RigModel& rig, int device) {
  return device < 0 ? rig.projector : rig.cameras[static_cast<std::size_t>(device)];
}

std::string device_text(int device, const std::vector<NamedCamera>& cameras) {
  if (device < 0) return "the projector";
  return cameras.size() == 1 ? "the camera" : "camera " + cameras[static_cast<std::size_t>(device)].name;
}

/// Length of three values and its standard deviation, along their own direction.
struct Length {
  double value, sigma;
};
Length length_at(Eigen::Index first, const Eigen::VectorXd& by, const Eigen::MatrixXd& covariance) {
  const Eigen::Vector3d values = by.segment<3>(first);
  const Eigen::Vector3d along = values.norm() > 0 ? Eigen::Vector3d(values.normalized()) : Eigen::Vector3d::UnitX();
  return {values.norm(), std::sqrt(along.dot(covariance.block<3, 3>(first, first) * along))};
}

}  // namespace

std::vector<Explanation> explanations(std::size_t cameras) {
  const int devices = static_cast<int>(cameras);
  std::vector<Explanation> turned{{}}, farther{{}}, focused{{}}, placed, moved;
  for (int device = -1; device < devices; ++device) {
    add_axes(turned.emplace_back(), Kind::kTurn, device);
    focused.push_back({{Kind::kFocus, device}});
    if (device == 0) continue;  // the others are placed by the first camera
    farther.push_back({{Kind::kDistance, device}});
  }
  for (const Explanation& turn : turned) {
    for (const Explanation& distance : farther) placed.push_back(joined(turn, distance));
  }
  for (int device = -1; device < devices; ++device) {
    // Seen from each other, one camera and one projector move alike, whichever of them moves.
    if (device == 0 && cameras == 1) continue;
    add_axes(moved.emplace_back(), Kind::kTurn, device);
    add_axes(moved.back(), Kind::kShift, device);
  }
  std::vector<Explanation> all;
  for (const Explanation& focus : focused) {
    for (const Explanation& place : placed) all.push_back(joined(place, focus));
    for (const Explanation& place : moved) all.push_back(joined(place, focus));
  }
  for (const Explanation& focus : focused) {
    for (const Explanation& turn : turned) all.push_back(joined(joined(turn, focus), {{Kind::kPrint}}));
  }
  return all;
}

Explanation everything(std::size_t cameras) {
  Explanation all;
  for (int device = -1; device < static_cast<int>(cameras); ++device) {
    all.push_back({Kind::kFocus, device});
    if (device == 0) continue;
    add_axes(all, Kind::kTurn, device);
    add_axes(all, Kind::kShift, device);
  }
  return all;
}

bool has(const Explanation& explanation, Kind kind) {
  return std::ranges::find(explanation, kind, &DriftParameter::kind) != explanation.end();
}

double plausible_drift(const DriftParameter& parameter, double baseline_mm) {
  switch (parameter.kind) {
    case Kind::kTurn:
      return kTurnDeg / kDegrees;
    case Kind::kShift:
    case Kind::kDistance:
      return std::max(kShiftMm, kShiftOfBaseline * baseline_mm);
    case Kind::kFocus:
      return kFocus;
    case Kind::kPrint:
      break;
  }
  return kPrint;
}

RigModel drifted(const RigModel& rig, const Explanation& explanation, const Eigen::VectorXd& by) {
  RigModel out = rig;
  std::vector<DeviceDrift> drifts(rig.cameras.size() + 1);  // the projector first
  for (std::size_t i = 0; i < explanation.size(); ++i) {
    const auto& [kind, device, axis] = explanation[i];
    const double value = by(static_cast<Eigen::Index>(i));
    DeviceDrift& drift = drifts[static_cast<std::size_t>(device + 1)];
    if (kind == Kind::kPrint) out.board_scale += value;
    if (kind == Kind::kFocus) drift.focus = value;
    if (kind == Kind::kDistance) drift.farther_mm = value;
    if (kind == Kind::kTurn) drift.motion[static_cast<std::size_t>(axis)] = value;
    if (kind == Kind::kShift) drift.motion[static_cast<std::size_t>(3 + axis)] = value;
  }
  // The rig's frame follows the first camera, so to the others a move of it is the opposite move.
  const RigidTransform rig_from_before = to_motion(drifts[1].motion).inverse();
  for (int device = -1; device < static_cast<int>(rig.cameras.size()); ++device) {
    const DeviceDrift& drift = drifts[static_cast<std::size_t>(device + 1)];
    DeviceModel& model = device_of(out, device);
    model.lens[0] *= 1 + drift.focus, model.lens[1] *= 1 + drift.focus;
    if (device == 0) continue;
    RigidTransform device_from_rig = to_motion(model.device_from_rig);
    device_from_rig.translation += drift.farther_mm * device_from_rig.translation.normalized();
    model.device_from_rig = to_vector(to_motion(drift.motion).after(device_from_rig).after(rig_from_before));
  }
  return out;
}

RigModel to_rig(const Calibration& calibration) {
  const auto device = [](const Lens& lens, const RigidTransform& device_from_rig) {
    return DeviceModel{{lens.width_px, lens.height_px}, to_vector(lens), to_vector(device_from_rig)};
  };
  RigModel rig;
  for (const CalibratedCamera& camera : calibration.cameras) {
    rig.cameras.push_back(device(camera.lens, camera.rig_from_camera.inverse()));
  }
  rig.projector = device(calibration.projector, calibration.cameras.front().projector_from_camera);
  return rig;
}

std::string drift_text(const Explanation& explanation, const Eigen::VectorXd& by, const Eigen::MatrixXd& covariance,
                       const std::vector<NamedCamera>& cameras) {
  std::string text;
  const auto add = [&](const std::string& more) { text += (text.empty() ? "" : "; ") + more; };
  for (std::size_t i = 0; i < explanation.size(); ++i) {
    const auto& [kind, device, axis] = explanation[i];
    const auto at = static_cast<Eigen::Index>(i);
    if (axis > 0) continue;  // told with the first axis
    const std::string who = device_text(device, cameras);
    if (kind == Kind::kTurn) {
      const Length turn = length_at(at, by, covariance);
      add(fmt::format("{} turned by {:.3f} +- {:.3f} degrees", who, turn.value * kDegrees, turn.sigma * kDegrees));
    } else if (kind == Kind::kShift) {
      const Length shift = length_at(at, by, covariance);
      add(fmt::format("{} moved by {:.2f} +- {:.2f} mm", who, shift.value, shift.sigma));
    } else if (kind == Kind::kDistance) {
      add(fmt::format("{} is {:.2f} +- {:.2f} mm {} the {}camera", who, std::abs(by(at)), std::sqrt(covariance(at, at)),
                      by(at) > 0 ? "farther from" : "nearer to", cameras.size() == 1 ? "" : "first "));
    } else {
      const std::string what = kind == Kind::kFocus ? "the focal length of " + who : std::string("the board's print");
      add(fmt::format("{} is {:.3f} +- {:.3f} % {}", what, 100 * std::abs(by(at)), 100 * std::sqrt(covariance(at, at)),
                      by(at) > 0 ? "longer" : "shorter"));
    }
  }
  return text;
}

}  // namespace slsd
