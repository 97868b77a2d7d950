// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <vector>

#include "core/hand_eye/hand_eye_verdict.hpp"
#include "core/hand_eye/pose_reading.hpp"

namespace slsd {

/// Result of a record. Without findings, `fit` is the calibration.
struct HandEyeResult {
  std::vector<HandEyeFinding> findings;
  HandEyeSession session;         ///< in the reading that explains the pictures best
  HandEyeModel model;             ///< and what happened in it
  std::optional<HandEyeFit> fit;  ///< of that session and model; empty with too few poses
  HandEyeVerdict verdict;
  double evidence_gain = 0;  ///< natural logarithm of how much likelier the findings are than a faultless record
};

/// Calibrates a scanner's place in a robot cell, and names what is wrong with the record.
///
/// Each fault is a hypothesis: another reading of the same numbers, or another model of what happened meanwhile. All go
/// through the same adjustment, and the evidence decides, with a prior that makes each fault rare. A faultless record
/// wins unless a hypothesis is clearly likelier.
/// @param working_distance_mm  of the scanner, for the verdict
/// @errors those of read_session(), if no reading of the numbers explains them
/// @thread reentrant
[[nodiscard]] Result<HandEyeResult> diagnose_hand_eye(const HandEyeRecord& record, double working_distance_mm);

}  // namespace slsd
