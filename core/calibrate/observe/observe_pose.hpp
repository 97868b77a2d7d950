// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <vector>

#include "core/board/find_board.hpp"
#include "core/calibrate/observe/observations.hpp"
#include "core/decode/pattern_reader.hpp"
#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

/// The pictures of one pose by one camera.
struct PosePictures {
  GreyView white;
  std::vector<GreyView> coded;  ///< the pattern alone, or the Gray code
  std::optional<GreyView> black;
};

/// Finds the board in the white picture.
/// @errors errors of find_board()
/// @thread reentrant
[[nodiscard]] Result<PoseView> observe_board(const PosePictures& pictures, const Board& board, BoardSighting& sighting);

/// Reads the pattern on the board, with the light and the print divided out.
/// @param view  gets the symbols; symbols beside the board are ignored
/// @errors kMismatch; kNotFound: the pattern is not visible; kUnsupported: the pictures are too large
[[nodiscard]] Result<> observe_pattern(const PosePictures& pictures, const Board& board, const BoardSighting& sighting,
                                       PatternReader& reader, PoseView& view);

/// The same with a Gray code.
/// @errors kMismatch; kNotFound
/// @thread reentrant
[[nodiscard]] Result<> observe_gray_code(const PosePictures& pictures, const Board& board,
                                         const BoardSighting& sighting, const ImageSize& projector, PoseView& view);

}  // namespace slsd
