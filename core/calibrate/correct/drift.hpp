// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/calibrate/solve/rig_model.hpp"

namespace slsd {

/// A number by which a calibrated rig may have drifted.
struct DriftParameter {
  enum class Kind {
    kTurn,      ///< of a device about its own centre, rad
    kShift,     ///< of a device, in its own frame after the turn, mm
    kDistance,  ///< of a device from the first camera: how much farther it is, mm
    kFocus,     ///< of a device: excess of its focal length, relative
    kPrint,     ///< excess of the print over its stated size, relative: not a drift, but looks like one
  };
  Kind kind;
  int device = -1;  ///< index of the camera, or -1: the projector
  int axis = 0;     ///< of a turn or a shift: 0 to 2

  friend bool operator==(const DriftParameter&, const DriftParameter&) = default;
};

/// An explanation of what a view shows: the parameters that drifted. All others stay as calibrated.
using Explanation = std::vector<DriftParameter>;

/// All explanations to compare, the one without any drift first. One device turned, or none; its distance changed, or
/// it moved anywhere, or neither; the focus of one device changed, or none. Or the print has another size, instead of a
/// distance: they look alike.
/// @param cameras  1 or more
/// @thread reentrant
[[nodiscard]] std::vector<Explanation> explanations(std::size_t cameras);

/// Every parameter that a view can show, without one that only repeats others: a moved first camera looks as if all
/// other devices had moved.
[[nodiscard]] Explanation everything(std::size_t cameras);

/// Tells whether an explanation has a parameter of a kind.
[[nodiscard]] bool has(const Explanation& explanation, DriftParameter::Kind kind);

/// Plausible size of a drift before any view: one standard deviation about 0.
/// @param baseline_mm  distance between the projector and the first camera
[[nodiscard]] double plausible_drift(const DriftParameter& parameter, double baseline_mm);

/// Changes a calibrated rig. Its frame stays the first camera's.
/// @param by  one value for each parameter
/// @thread reentrant
[[nodiscard]] RigModel drifted(const RigModel& rig, const Explanation& explanation, const Eigen::VectorXd& by);

/// A calibration as a rig without poses.
[[nodiscard]] RigModel to_rig(const Calibration& calibration);

/// Says what drifted and by how much: "the projector turned by 0.100 +- 0.004 degrees".
/// @param covariance  of the values
[[nodiscard]] std::string drift_text(const Explanation& explanation, const Eigen::VectorXd& by,
                                     const Eigen::MatrixXd& covariance, const std::vector<NamedCamera>& cameras);

}  // namespace slsd
