// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <vector>

#include "core/calibrate/judge/trueness.hpp"
#include "core/calibrate/observe/observations.hpp"
#include "core/geometry/calibration.hpp"
#include "core/geometry/epipolar_limit.hpp"
#include "core/result.hpp"

namespace slsd {

/// Limits of the figures up to which a calibration still holds.
struct VerifyLimits {
  double trueness_percent = 0.2;  ///< limit of the common factor, and of the long distances' errors
  double plane_sigmas = 3;        ///< off the plane, times what the noise of the symbols explains
  double plane_percent = 0.1;     ///< off the plane, of the distance
  double epipolar_px = epipolar_limit_px(std::nullopt);  ///< off the epipolar lines, in the projector
  double turn_deg = 0.03;                                ///< apparent turn of projector and camera against each other
};

/// Check of the calibration by one camera's look at a flat thing. Root mean squares.
struct ViewCheck {
  std::size_t symbols = 0;                    ///< symbols that took part
  std::size_t left_out = 0;                   ///< misread, or beside the plane
  double distance_mm = 0;                     ///< distance of the plane's middle from the camera
  double epipolar_rms_px = 0;                 ///< symbols off their epipolar lines, in the projector
  double turn_deg = 0;                        ///< turn of the projector against the camera, from the epipolar lines
  double turn_sigma_deg = 0;                  ///< one standard deviation of that
  std::optional<Eigen::Vector3d> blind_axis;  ///< projector's axis about which a turn does not show here
  double plane_rms_mm = 0;                    ///< symbols off their plane
  double plane_sigma_mm = 0;                  ///< the same, as the noise of the symbols in this look lets expect
  std::optional<Trueness> trueness;           ///< nothing without a board

  [[nodiscard]] double plane_limit_mm(const VerifyLimits& limits) const;
};

/// Measures a flat thing by a calibration: the symbols give a plane, and the board's points lie on it.
/// @param view  corners may be missing: a plain plane
/// @errors kNotFound: too few symbols; kImpossible: they do not lie on one plane
/// @thread reentrant
[[nodiscard]] Result<ViewCheck> check_view(const PoseView& view, const CalibratedCamera& camera, const Lens& projector);

enum class VerifyFault {
  kEpipolar,   ///< the devices moved against each other, or a lens did
  kPlane,      ///< flat things are measured bent
  kScale,      ///< all distances are wrong by the same factor
  kDistances,  ///< distances are wrong, each by its own share
};

/// @return in the order of VerifyFault; empty where the calibration holds
/// @thread reentrant
[[nodiscard]] std::vector<VerifyFault> find_faults(const ViewCheck& check, const VerifyLimits& limits);

/// All views together.
struct VerifySummary {
  std::size_t views = 0, views_with_board = 0;
  double epipolar_rms_px = 0;       ///< over all symbols
  double plane_percent = 0;         ///< root mean square off the planes, of the distance
  double scale_percent = 0;         ///< the mean over the boards
  double long_rms_percent = 0;      ///< over the boards' long distances
  std::vector<VerifyFault> faults;  ///< faults of any view, each once
};

/// @thread reentrant
[[nodiscard]] VerifySummary summarise(const std::vector<ViewCheck>& checks, const VerifyLimits& limits);

}  // namespace slsd
