// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/calibrate/observe/observations.hpp"
#include "core/calibrate/solve/pose_influence.hpp"
#include "core/calibrate/solve/rig_model.hpp"

namespace slsd {

/// Reason for leaving a pose out.
enum class PoseFault {
  kNotSeen,  ///< no board, no pattern, or an unreadable file
  kTooFewCorners,
  kTooFewSymbols,
  kBlurred,
  kClipped,   ///< too much of the board is saturated
  kRepeated,  ///< it shows the board at the place of an earlier pose
  kBent,      ///< the board is not flat
  kMoved,     ///< the board moved between its picture and that of the pattern
  kSwapped,   ///< the pattern's picture belongs to another pose
  kCovered,   ///< an object stood before the board
  kUnlike,    ///< it contradicts the others for another reason
};
[[nodiscard]] std::string_view to_string(PoseFault fault);

struct FaultyPose {
  std::size_t pose;
  PoseFault fault;
  std::string reason;  ///< for the user: the observation, with the figure, and what to do
};

/// Poses that cannot take part, whatever the others show: too few points, or much more blur than the others.
/// @thread reentrant
[[nodiscard]] std::vector<FaultyPose> find_unusable(const Observations& observations);

/// A pose with so many outlying points that the rest does not determine its place, if there is one.
/// @thread reentrant
[[nodiscard]] std::optional<FaultyPose> find_unplaced(const Observations& observations, const RigModel& rig,
                                                      const PoseInfluence& influence);

/// The pose that contradicts the others most, if any; poses that are not placed come first. Its error under the rig
/// from the other poses is far above theirs. Its points show the reason: symbols on a plane of their own mean a board
/// that moved, a smooth bow means a bent board.
/// @param rig  at its solution, one pose for each of the observations
/// @thread reentrant
[[nodiscard]] std::optional<FaultyPose> find_contradiction(const Observations& observations, const RigModel& rig,
                                                           const PoseInfluence& influence);

}  // namespace slsd
