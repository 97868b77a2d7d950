// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include "core/board/board.hpp"
#include "core/calibrate/correct/deviations.hpp"
#include "core/result.hpp"

namespace slsd {

struct CorrectOptions {
  /// The print's ruler was measured for this view. Otherwise a board of another size is the likelier explanation of a
  /// rig whose distances changed and nothing else.
  bool print_measured = false;
  std::vector<double> depths_mm;  ///< depths at which deviations are predicted, at least one
};

/// Result of looking for drift.
struct Correction {
  bool needed = false;                  ///< false: the calibration holds, and `calibration` is the same
  Calibration calibration;              ///< corrected
  std::string drift;                    ///< what drifted and by how much, in words
  std::vector<DeviationAt> deviations;  ///< one for each depth
};

/// Finds what drifted in a calibrated rig, from a view of a board: the turn and place of a device, and the focal length
/// of one. It compares all explanations by their evidence, so a parameter changes only if the view asks for it. The
/// calibration holds if no explanation is clearly better than none, or if points hardly move by it.
/// @param observations  usually one pose; every camera sees it
/// @errors kNotFound: a camera does not see the board, or sees too little of it or of the pattern; kMismatch: the board
///         has another size; kImpossible: the board is bent, more than a drift has changed, or the view does not tell
///         how to correct. The message says what to do.
/// @thread reentrant
[[nodiscard]] Result<Correction> correct_calibration(Observations observations, const Board& board,
                                                     const Calibration& calibration, const CorrectOptions& options);

}  // namespace slsd
