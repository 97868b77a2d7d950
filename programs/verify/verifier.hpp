// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/board/board.hpp"
#include "core/calibrate/correct/correct.hpp"
#include "core/calibrate/observe/observe_pose.hpp"
#include "core/calibrate/verify/verify.hpp"
#include "core/code/codebook.hpp"
#include "core/geometry/calibration.hpp"
#include "core/result.hpp"
#include "daemon/configuration/configuration.hpp"
#include "programs/calibrate/calibrate_request.hpp"
#include "programs/calibrate/captures/captured_pictures.hpp"

namespace slsd {

/// Checks the calibration in force with flat objects, and prints the result of each view.
/// @thread thread-bound
class Verifier {
 public:
  /// @param pattern    the projected one, unless it is a Gray code
  /// @errors kNotFound: no calibration is configured; those of its file and of the board's text; kInvalidArgument: a
  ///         ruler without a board; kMismatch: the pattern is for another projector
  [[nodiscard]] static Result<Verifier> create(const CalibrateRequest& request, const Configuration& configuration,
                                               Pattern pattern, bool gray_code);

  /// Evaluates one camera's view. Prints what cannot be measured, and does not count it.
  /// @param pose      groups the views of several cameras; printed before the result, with the camera
  /// @param camera    its name; empty: the first configured one
  /// @param pictures  without a white one: a plain plane
  /// @errors kNotFound: the calibration does not contain the camera, or a correction needs the board, which was not
  ///         found; kMismatch: the pictures have another size
  [[nodiscard]] Result<> look(const std::string& pose, const std::string& camera, const CapturedPictures& pictures);

  /// Prints the result of all views together.
  /// @errors kMismatch: the calibration no longer holds; the message says what to do; kNotFound: nothing was measured,
  ///         or the requested board was never seen
  [[nodiscard]] Result<> finish() const;

  /// Finds out from the views of the board how to correct the calibration, and prints how far off it is. Changes no
  /// file.
  /// @errors those of correct_calibration()
  [[nodiscard]] Result<Correction> find_correction() const;
  /// Prints the checks of the views again, with another calibration.
  void check_again(const Calibration& calibration) const;

  [[nodiscard]] const Pattern& pattern() const { return pattern_.pattern(); }

 private:
  Verifier(Calibration calibration, Board board, Pattern pattern)
      : calibration_(std::move(calibration)), board_(board), pattern_(std::move(pattern)) {}
  [[nodiscard]] std::string offer() const;
  [[nodiscard]] Result<PoseView> observe(const CapturedPictures& pictures, std::size_t camera, std::string& remark);
  [[nodiscard]] Result<PoseView> observe_without_board(const PosePictures& pictures, bool has_white,
                                                       PatternReader& reader) const;

  Calibration calibration_;
  Board board_;
  IndexedPattern pattern_;
  std::string first_camera_;
  bool gray_code_ = false;
  bool board_asked_for_ = false, needs_board_ = false;
  CorrectOptions correct_options_;
  VerifyLimits limits_;
  std::map<std::size_t, PatternReader> readers_;  // one for each camera: each remembers where its pattern lies
  std::vector<ViewCheck> checks_;
  Observations observations_;  // at the board
};

}  // namespace slsd
