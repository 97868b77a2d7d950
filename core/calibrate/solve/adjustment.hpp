// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include "core/calibrate/solve/bundle.hpp"
#include "core/calibrate/solve/pose_influence.hpp"
#include "core/calibrate/solve/rig_change.hpp"
#include "core/result.hpp"

namespace slsd {

/// The steps of an adjustment: solve, measure the noise, mark outliers, and solve again.
/// @thread thread-bound
class Adjustment {
 public:
  /// Adjusts the cameras first, then the projector, then everything together.
  /// @param observations  in and out: outliers are marked
  /// @param rig           cameras and poses, as estimated
  /// @errors kImpossible
  [[nodiscard]] static Result<Adjustment> begin(Observations& observations, RigModel rig);

  /// Adjusts everything together from the current state.
  [[nodiscard]] Result<> adjust_again(Observations& observations);

  /// Determines whether the board is stretched, and adjusts again.
  [[nodiscard]] Result<> look_for_stretch(Observations& observations);

  /// Continues with views of the reference plane among the poses. With two or more views, the board's scale is free, so
  /// that prints of different scales do not contradict each other.
  [[nodiscard]] Result<> begin_with_planes(Observations& observations);

  /// Fixes the board's scale again if the prints agree within their deviations; otherwise warns of their difference.
  [[nodiscard]] Result<> compare_prints(Observations& observations);

  /// Looks for a change of the rig during the session.
  [[nodiscard]] std::optional<RigChange> find_change(const Observations& observations) const {
    return find_rig_change(observations, options_, rig_);
  }

  [[nodiscard]] RigModel& rig() { return rig_; }
  [[nodiscard]] const RigModel& rig() const { return rig_; }
  [[nodiscard]] const BundleEquations& equations() const { return equations_; }
  [[nodiscard]] const PoseInfluence& influence() const { return influence_; }
  [[nodiscard]] std::vector<std::string> warnings() const;

 private:
  explicit Adjustment(RigModel rig) : rig_(std::move(rig)) {}
  [[nodiscard]] Result<> find_influence_of(const Observations& observations);
  [[nodiscard]] std::string unplaced_text(const Observations& observations) const;
  /// Removes poses, so that they have no effect on later steps.
  [[nodiscard]] std::vector<PoseObservation> set_aside(const std::vector<std::size_t>& doubtful,
                                                       Observations& observations);
  /// Restores the poses at the places that their corners give, to be judged by the others.
  [[nodiscard]] Result<> take_back(const std::vector<std::size_t>& doubtful, std::vector<PoseObservation> aside,
                                   Observations& observations);
  template <class Visit>
  void visit_components(Observations& observations, Visit visit) const;
  void measure_noise(Observations& observations);
  void mark_outlying(Observations& observations) const;
  [[nodiscard]] Result<> adjust_to_lenses(const Observations& observations);
  [[nodiscard]] bool is_stretched() const;

  RigModel rig_;
  BundleOptions options_;
  BundleEquations equations_;
  PoseInfluence influence_;
  bool settled_ = true;  // whether the last full adjustment converged
  std::vector<std::string> warnings_;
};

[[nodiscard]] double value_of(const SharedParameter& parameter, const RigModel& rig);

}  // namespace slsd
