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

/// The observer of the poses' pictures, camera by camera.
/// @thread thread-bound
class PoseObserver {
 public:
  /// @param gray_code  whether a Gray code is projected instead of the pattern
  PoseObserver(const Board& board, const IndexedPattern& pattern, const ImageSize& projector, bool gray_code);

  /// @errors what observe_board(), observe_pattern() and observe_gray_code() say
  [[nodiscard]] Result<PoseView> observe(std::size_t camera, const PosePictures& pictures);

  /// The share of the white picture's print that is in a pattern's picture, and its place there.
  /// @return a significance of 0 where the board is not found
  [[nodiscard]] PrintShift print_shift(const GreyView& white, const GreyView& pattern) const;

  /// The board as it is: that which was named, or the same named rows by columns, where the first pictures show that.
  [[nodiscard]] const Board& board() const { return board_; }

 private:
  Board board_;
  IndexedPattern pattern_;
  ImageSize projector_;
  bool gray_code_;
  bool seen_ = false;                             // the board, so that it is known which way it was named
  std::map<std::size_t, PatternReader> readers_;  // one to a camera: each keeps where its pattern lies
};

/// The observers, one for each print.
struct PoseObservers {
  PoseObserver board;
  std::optional<PoseObserver> plane;  ///< empty without a reference plane, of which nothing may be observed then

  [[nodiscard]] PoseObserver& of(PoseSubject subject) { return subject == PoseSubject::kPlane ? plane.value() : board; }
};

/// @param plane  nothing: there is none
[[nodiscard]] PoseObservers make_observers(const Board& board, const std::optional<Board>& plane,
                                           const IndexedPattern& pattern, const ImageSize& projector, bool gray_code);

}  // namespace slsd
