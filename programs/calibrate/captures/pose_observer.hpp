// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/board/find_board.hpp"
#include "core/calibrate/observe/observe_pose.hpp"
#include "core/calibrate/observe/print_shift.hpp"
#include "core/code/codebook.hpp"

namespace slsd {

/// Observes the poses' pictures, camera by camera.
/// @thread thread-bound
class PoseObserver {
 public:
  /// @param gray_code  a Gray code is projected instead of the pattern
  PoseObserver(const Board& board, const IndexedPattern& pattern, const ImageSize& projector, bool gray_code);

  /// @errors those of observe_board(), observe_pattern() and observe_gray_code()
  [[nodiscard]] Result<PoseView> observe(std::size_t camera, const PosePictures& pictures);

  /// Measures how much of the white picture's print shows in a pattern's picture, and where.
  /// @return a significance of 0 if the board is not found
  [[nodiscard]] PrintShift print_shift(const GreyView& white, const GreyView& pattern) const;

  /// The actual board: as named, or with rows and columns swapped if the first pictures show that.
  [[nodiscard]] const Board& board() const { return board_; }

 private:
  Board board_;
  IndexedPattern pattern_;
  ImageSize projector_;
  bool gray_code_;
  bool seen_ = false;                             // the board was seen, so its orientation is known
  std::map<std::size_t, PatternReader> readers_;  // one for each camera: each remembers where its pattern lies
};

/// The observers, one for each print.
struct PoseObservers {
  PoseObserver board;
  std::optional<PoseObserver> plane;  ///< empty without a reference plane; then no plane may be observed

  [[nodiscard]] PoseObserver& of(PoseSubject subject) { return subject == PoseSubject::kPlane ? plane.value() : board; }
};

/// @param plane  nothing: no plane
[[nodiscard]] PoseObservers make_observers(const Board& board, const std::optional<Board>& plane,
                                           const IndexedPattern& pattern, const ImageSize& projector, bool gray_code);

}  // namespace slsd
