// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "clients/model/places/align.hpp"

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
};

/// Follows a rigid object from frame to frame. The object's frame is the rig's at the first frame.
/// @thread thread-bound
class Tracker {
 public:
  /// @param step_degrees  known turn from one frame to the next, about any axis of the rig; 0: unknown
  explicit Tracker(double step_degrees = 0) : step_degrees_(step_degrees) {}

  /// Places a frame by the latest keyframes, from the last motion on. If that fails, tries all keyframes.
  /// @param number  of the frame, for ModelFrame; greater than the one before
  [[nodiscard]] Tracked add(std::size_t number, Shot shot);

  /// The frames that were placed, in order.
  [[nodiscard]] std::vector<ModelFrame>& frames() { return frames_; }
  [[nodiscard]] const std::vector<ModelFrame>& frames() const { return frames_; }

 private:
  [[nodiscard]] Tracked begin(const Shot& shot) const;
  [[nodiscard]] Tracked follow(const Shot& shot) const;
  [[nodiscard]] std::optional<Alignment> search(const Shot& shot) const;
  [[nodiscard]] std::vector<PlacedShot> latest_keyframes() const;
  [[nodiscard]] RigidTransform expected() const;
  [[nodiscard]] std::optional<Alignment> step(const Shot& shot) const;

  double step_degrees_;
  std::vector<ModelFrame> frames_;
  std::vector<std::size_t> keyframes_;  // indices of frames_
  bool lost_ = false;
};

/// Degrees between the orientations of two places.
[[nodiscard]] double turn_degrees(const RigidTransform& a, const RigidTransform& b);

/// The reason why an alignment does not put a shot into a model; empty if it does.
[[nodiscard]] std::string refusal_of(const Alignment& alignment);

}  // namespace slsd::model
