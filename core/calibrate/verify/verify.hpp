// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <vector>

#include "core/calibrate/observe/observations.hpp"
#include "core/calibrate/verify/trueness.hpp"
#include "core/geometry/calibration.hpp"
#include "core/geometry/epipolar/epipolar_limit.hpp"
#include "core/result.hpp"

namespace slsd {

/// Limits up to which a calibration still holds.
struct VerifyLimits {
  double trueness_percent = 0.2;  ///< limit of the common factor, and of the long distances' errors
  double plane_sigmas = 3;        ///< distance from the plane, in multiples of what the symbols' noise explains
  double plane_percent = 0.1;     ///< distance from the plane, relative to the viewing distance
  double epipolar_px = epipolar_limit_px(std::nullopt);  ///< distance from the epipolar lines, in the projector
  double turn_deg = 0.03;                                ///< apparent turn between projector and camera
};

/// Check of the calibration by one camera's view of a flat object. Root mean squares.
struct ViewCheck {
  std::size_t symbols = 0;                    ///< number of used symbols
  std::size_t left_out = 0;                   ///< misread, or off the plane
  double distance_mm = 0;                     ///< distance of the plane's centre from the camera
  double epipolar_rms_px = 0;                 ///< symbols off their epipolar lines, in the projector
  double turn_deg = 0;                        ///< turn of the projector relative to the camera, from the epipolar lines
  double turn_sigma_deg = 0;                  ///< one standard deviation of the turn
  std::optional<Eigen::Vector3d> blind_axis;  ///< projector's axis about which a turn is not visible here
  double plane_rms_mm = 0;                    ///< symbols off their plane
  double plane_sigma_mm = 0;                  ///< expected value of plane_rms_mm from the symbols' noise in this view
  std::optional<Trueness> trueness;           ///< empty without a board

  [[nodiscard]] double plane_limit_mm(const VerifyLimits& limits) const;
};

/// Measures a flat object by a calibration: the symbols give a plane, and the board's points lie on it.
/// @param view  corners may be missing, as on a blank plane
/// @errors kNotFound: too few symbols; kImpossible: the symbols do not lie on one plane
/// @thread reentrant
[[nodiscard]] Result<ViewCheck> check_view(const PoseView& view, const CalibratedCamera& camera, const Lens& projector);

enum class VerifyFault {
  kEpipolar,   ///< the devices moved relative to each other, or a lens changed
  kPlane,      ///< flat objects are measured bent
  kScale,      ///< all distances are wrong by the same factor
  kDistances,  ///< distances are wrong by different factors
};

/// @return in the order of VerifyFault; empty if the calibration holds
/// @thread reentrant
[[nodiscard]] std::vector<VerifyFault> find_faults(const ViewCheck& check, const VerifyLimits& limits);

/// Summary of all views.
struct VerifySummary {
  std::size_t views = 0, views_with_board = 0;
  double epipolar_rms_px = 0;       ///< over all symbols
  double plane_percent = 0;         ///< root mean square distance from the planes, relative to the viewing distance
  double scale_percent = 0;         ///< the mean over the boards
  double long_rms_percent = 0;      ///< over the boards' long distances
  std::vector<VerifyFault> faults;  ///< faults of any view, without repetition
};

/// @thread reentrant
[[nodiscard]] VerifySummary summarise(const std::vector<ViewCheck>& checks, const VerifyLimits& limits);

}  // namespace slsd
