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

/// Reason why a pose is left out.
enum class PoseFault {
  kNotSeen,  ///< no board, no pattern, or an unreadable file
  kTooFewCorners,
  kTooFewSymbols,
  kBlurred,
  kClipped,   ///< too much of the board is at full level
  kRepeated,  ///< it shows the board where an earlier one does
  kBent,      ///< the board is not flat
  kMoved,     ///< between the picture of the board and that of the pattern
  kSwapped,   ///< the pattern's picture is another pose's
  kCovered,   ///< something stood before the board
  kUnlike,    ///< it contradicts the others, for another reason
};
[[nodiscard]] std::string_view to_string(PoseFault fault);

struct FaultyPose {
  std::size_t pose;
  PoseFault fault;
  std::string reason;  ///< for a person: the observation, with the figure, and what to do
};

/// Poses that cannot take part whatever the others say: too little in them, or blurred against the others.
/// @thread reentrant
[[nodiscard]] std::vector<FaultyPose> find_unusable(const Observations& observations);

/// A pose that lies so far off the others that what is left of its points does not say where it is, if there is one.
/// @thread reentrant
[[nodiscard]] std::optional<FaultyPose> find_unplaced(const Observations& observations, const RigModel& rig,
                                                      const PoseInfluence& influence);

/// The pose that contradicts the others most, if one does, those that are not placed first: its error under the rig
/// that they give is far above theirs. Why follows from what its points show: a symbol plane of its own is a board that
/// moved, a smooth bow is a bent one.
/// @param rig  at its solution, one pose to each of the observations
/// @thread reentrant
[[nodiscard]] std::optional<FaultyPose> find_contradiction(const Observations& observations, const RigModel& rig,
                                                           const PoseInfluence& influence);

}  // namespace slsd
