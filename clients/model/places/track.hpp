// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "clients/model/places/align.hpp"
#include "clients/model/places/foreign_cells.hpp"

namespace slsd::model {

/// A frame's place, or why it has none.
struct Tracked {
  std::optional<Alignment> alignment;  ///< of a frame that fits
  std::string refusal;                 ///< of a frame that does not, for the user
  bool found_again = false;            ///< the frame before was lost
};

/// A frame of the model.
struct ModelFrame {
  std::size_t number = 0;  ///< as given to add()
  Shot shot;               ///< without its pixels
  RigidTransform object_from_rig;

  [[nodiscard]] PlacedShot placed() const { return {&shot, object_from_rig}; }
};

/// Follows a rigid object from frame to frame. The object's frame is the rig's at the first frame.
/// @thread thread-bound
class Tracker {
 public:
  /// @param step_degrees  known turn from one frame to the next, about any axis of the rig; 0: unknown
  explicit Tracker(double step_degrees = 0) : step_degrees_(step_degrees) {}

  /// Places a frame by the latest keyframes, from the last motion on. If that fails, tries all keyframes: what they
  /// saw must be there, and if nothing led to the place, no part of a flat shot is taken for another. Refuses a frame
  /// in which two bodies moved differently since the one before.
  /// @param number  of the frame, for ModelFrame; greater than the one before
  [[nodiscard]] Tracked add(std::size_t number, Shot shot);

  /// The frames that were placed, in order.
  [[nodiscard]] std::vector<ModelFrame>& frames() { return frames_; }
  [[nodiscard]] const std::vector<ModelFrame>& frames() const { return frames_; }
  /// Marks the foreign cells of all frames, by what the keyframes saw. Call again after places were moved.
  void mark_foreign_cells();

 private:
  [[nodiscard]] Tracked begin(const Shot& shot) const;
  [[nodiscard]] Tracked follow(std::size_t number, const Shot& shot);
  [[nodiscard]] bool is_of_two(const Shot& shot, const RigidTransform& object_from_rig, bool refused) const;
  [[nodiscard]] std::optional<Alignment> search(std::size_t number, const Shot& shot) const;
  [[nodiscard]] bool is_found(const PlacedShot& placed, std::size_t number,
                              std::span<const PlacedShot> references) const;
  [[nodiscard]] bool is_expected(std::size_t number, const RigidTransform& object_from_rig) const;
  [[nodiscard]] std::vector<PlacedShot> latest_keyframes() const;
  void add_keyframe();
  [[nodiscard]] RigidTransform expected() const;
  [[nodiscard]] std::optional<Alignment> step(const Shot& shot) const;

  double step_degrees_;
  std::vector<ModelFrame> frames_;
  std::vector<std::size_t> keyframes_;       // indices of frames_
  std::vector<ShotEvidence> evidence_;       // of each keyframe, by the others
  std::optional<ModelFrame> doubtful_;       // the latest frame, if it showed two bodies: where one of them would be
  std::optional<RigidTransform> candidate_;  // best place of the frame that is being followed
  bool lost_ = false;
};

/// Degrees between the orientations of two places.
[[nodiscard]] double turn_degrees(const RigidTransform& a, const RigidTransform& b);

}  // namespace slsd::model
