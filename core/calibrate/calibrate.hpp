// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "core/calibrate/judge/board_report.hpp"
#include "core/calibrate/judge/depth_uncertainty.hpp"
#include "core/calibrate/judge/pose_list.hpp"
#include "core/calibrate/judge/reference_plane.hpp"
#include "core/calibrate/judge/verdict.hpp"
#include "core/calibrate/observe/observations.hpp"
#include "core/calibrate/solve/lens_terms.hpp"
#include "core/calibrate/solve/rig_model.hpp"
#include "core/result.hpp"

namespace slsd {

struct CalibrateOptions {
  double depth_min_mm = 400;  ///< the working range, in which the depth's uncertainty is foretold
  double depth_max_mm = 2500;
  Eigen::AlignedBox2d sheet_mm;  ///< the board with its white border, in the board's frame; empty: what is seen of it
};

struct ParameterReport {
  std::string device;  ///< the camera's name, or "projector"
  std::string name;    ///< "fx", "k1", "turn about x" ...
  double value = 0;    ///< px, 1, rad or mm
  double sigma = 0;    ///< one standard deviation
};

/// A calibration, and how good it is.
struct CalibrationOutcome {
  Calibration calibration;
  RigModel rig;               ///< with the poses that were used
  Observations observations;  ///< those that were used, with the outlying points marked
  std::vector<PoseReport> poses;
  std::vector<ParameterReport> parameters;
  double camera_rms_px = 0;                               ///< board corners in the cameras
  double projector_rms_px = 0;                            ///< symbols, in the projector
  double symbol_rms_px = 0;                               ///< symbols, in the cameras
  double epipolar_rms_px = 0;                             ///< symbols off their epipolar line, in the projector
  double held_out_corner_px = 0, held_out_symbol_px = 0;  ///< of poses that were left out in turn, in the cameras
  std::vector<DepthUncertainty> depth;                    ///< near, middle, far
  BoardReport board;
  std::vector<PlaneCheck> planes;  ///< one to a camera's look at the reference plane
  std::vector<std::string> warnings;
  Verdict verdict;
};

/// Calibrates cameras and projector together: Zhang's method, the projector by where the cameras' rays to its pixels
/// meet the board, then one adjustment of everything, in which terms of distortion take part only as far as the poses
/// determine them. Poses that contradict the others and points that lie off are left out and named.
///
/// Where there are looks at a reference plane (Elahi et al. 2020), that is the first step, without them. In the second
/// one each look is measured by the calibration so far, and then everything is adjusted again with the looks among the
/// poses.
/// @errors kImpossible: what was seen does not determine the rig; the message says what to shoot
/// @thread reentrant
[[nodiscard]] Result<CalibrationOutcome> calibrate(Observations observations, const CalibrateOptions& options);

}  // namespace slsd
