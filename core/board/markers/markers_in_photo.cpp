// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/board/markers/markers_in_photo.hpp"

#include <algorithm>
#include <string>

#include "core/board/layout.hpp"

namespace slsd {
namespace {

constexpr std::size_t kLeastMirrored = 3;

// By chance, few markers belong to a family in either image. A mirrored board has many, at their places on the board.
bool is_mirrored(const BoardPhoto& photo, const Board& board) {
  const auto seen = find_markers(mirrored(photo.grey), *board.family).markers;
  const auto own = markers_of_board(seen, board);
  return own && own->size() >= kLeastMirrored;
}

tl::unexpected<Error> refuse(const BoardPhoto& photo, const Board& board, const SeenMarkers& seen) {
  if (!seen.unknown.empty() && is_mirrored(photo, board)) {
    return fail(ErrorCode::kMismatch,
                "the board appears mirrored; turn off the camera's mirroring, or remove the mirror");
  }
  if (const auto* other = find_other_family(photo.grey, seen.unknown, *board.family)) {
    return fail(ErrorCode::kMismatch, "the picture shows another board: its markers are of " +
                                          std::string(other->name) + ", but those of " + describe(board) +
                                          " are not; give the board that was printed");
  }
  return fail(ErrorCode::kNotFound,
              "no marker of " + describe(board) + " is visible; light it, focus, and hold it in view");
}

}  // namespace

Result<std::vector<SeenMarker>> markers_in_photo(const BoardPhoto& photo, const Board& board) {
  const SeenMarkers seen = find_markers(photo.grey, *board.family);
  auto own = markers_of_board(seen.markers, board);
  if (own && own->size() >= kLeastMirrored) return own;
  if (own && own->empty()) return refuse(photo, board, seen);
  if (seen.unknown.size() > seen.markers.size() && is_mirrored(photo, board)) return refuse(photo, board, seen);
  return own;
}

}  // namespace slsd
