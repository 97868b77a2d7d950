// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/calibrate/judge/pose_faults.hpp"
#include "core/calibrate/observe/observations.hpp"
#include "core/calibrate/solve/rig_model.hpp"

namespace slsd {

/// Report on one pose.
struct PoseReport {
  std::string name;
  PoseSubject subject = PoseSubject::kBoard;
  std::optional<PoseFault> fault;    ///< the reason if the pose was left out
  std::string reason;                ///< the same for the user, with the figure; empty if the pose was used
  std::vector<std::string> without;  ///< for a used pose: cameras whose view was left out, with the reason
  std::vector<std::string> remarks;  ///< for a used pose: its minor faults
  std::size_t corners = 0, symbols = 0;
  std::size_t outlying_corners = 0, outlying_symbols = 0;
  double corner_rms_px = 0, symbol_rms_px = 0;  ///< errors in the camera
  HeldOut held_out;                             ///< under the rig from the other poses
};

/// List of the input's poses: those that take part, and the reasons for leaving the others out.
/// @thread thread-bound
class PoseList {
 public:
  /// Starts with all poses taking part.
  explicit PoseList(const Observations& observations);

  /// Removes a pose, by its index among those that take part, from all data.
  /// @param rig  null: it has no poses yet
  void leave_out(const FaultyPose& faulty, Observations& observations, RigModel* rig);
  /// Removes the views that cannot take part from the poses that do.
  void leave_views_out(Observations& observations);
  /// Appends to the reason of a pose that was left out.
  void explain(const std::string& pose, const std::string& more);

  /// Tells whether there were poses of a subject and all of them were left out.
  [[nodiscard]] bool lacks(PoseSubject subject) const;
  /// Returns the report of a pose, by its index among those that take part.
  [[nodiscard]] PoseReport& used(std::size_t pose) { return reports_[used_[pose]]; }
  /// All poses, in the order of the input.
  [[nodiscard]] const std::vector<PoseReport>& reports() const { return reports_; }
  /// "pose_01: blurred ...; pose_03: ..."; empty if none was left out.
  [[nodiscard]] std::string faults() const;

 private:
  std::vector<PoseReport> reports_;
  std::vector<std::size_t> used_;  // indices of the poses that take part
};

}  // namespace slsd
