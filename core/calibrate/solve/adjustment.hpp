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

/// The course of an adjustment: solved, the noise measured, what lies off marked, solved again.
/// @thread thread-bound
class Adjustment {
 public:
  /// Cameras first, then the projector, then everything together.
  /// @param observations  in and out: points that lie off are marked
  /// @param rig           cameras and poses, as estimated
  /// @errors kImpossible
  [[nodiscard]] static Result<Adjustment> begin(Observations& observations, RigModel rig);

  /// Everything together, from where it stands.
  [[nodiscard]] Result<> adjust_again(Observations& observations);

  /// Says whether the board is stretched, and adjusts once more.
  [[nodiscard]] Result<> look_for_stretch(Observations& observations);

  /// Goes on with looks at the reference plane among the poses. With two or more of them the board's scale is open, so
  /// that prints of different scales contradict nothing.
  [[nodiscard]] Result<> begin_with_planes(Observations& observations);

  /// Holds the board's scale again where the prints agree as far as can be told; otherwise says by how much they do
  /// not.
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
  /// Takes poses out, so that they have no part in what follows.
  [[nodiscard]] std::vector<PoseObservation> set_aside(const std::vector<std::size_t>& doubtful,
                                                       Observations& observations);
  /// Puts them back where their corners say, to be judged by the others.
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
  bool settled_ = true;  // the last time that all was adjusted
  std::vector<std::string> warnings_;
};

[[nodiscard]] double value_of(const SharedParameter& parameter, const RigModel& rig);

}  // namespace slsd
