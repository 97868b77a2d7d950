// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/calibrate/judge/board_report.hpp"
#include "core/calibrate/judge/depth_uncertainty.hpp"
#include "core/calibrate/judge/grade.hpp"
#include "core/calibrate/judge/pose_list.hpp"
#include "core/calibrate/observe/observations.hpp"
#include "core/calibrate/solve/rig_model.hpp"
#include "core/calibrate/verify/reference_plane.hpp"

namespace slsd {

struct ParameterReport {
  std::string device;  ///< the camera's name, or "projector"
  std::string name;    ///< "fx", "k1", "turn about x" ...
  double value = 0;    ///< px, 1, rad or mm
  double sigma = 0;    ///< one standard deviation
};

/// A calibration, and how good it is.
struct CalibrationOutcome {
  Calibration calibration;
  RigModel rig;               ///< holds the used poses
  Observations observations;  ///< used observations, with the outlying points marked
  std::vector<PoseReport> poses;
  std::vector<ParameterReport> parameters;
  double camera_rms_px = 0;                               ///< board corners in the cameras
  double projector_rms_px = 0;                            ///< symbols, in the projector
  double symbol_rms_px = 0;                               ///< symbols, in the cameras
  double epipolar_rms_px = 0;                             ///< symbols off their epipolar line, in the projector
  double held_out_corner_px = 0, held_out_symbol_px = 0;  ///< each pose under the calibration by the others, in the
                                                          ///< cameras
  std::vector<DepthUncertainty> depth;                    ///< near, middle, far
  BoardReport board;
  std::vector<PlaneCheck> planes;  ///< one for each camera's view of the reference plane
  std::vector<std::string> warnings;
  Verdict verdict;
};

}  // namespace slsd
