// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/board/layout.hpp"

#include <algorithm>
#include <iterator>
#include <string>

namespace slsd {
namespace {

constexpr std::size_t kLeastTenths = 6;    // tenths of the seen markers that must match the board's layout
constexpr double kToleranceOfSide = 0.35;  // lens distortion over the whole board is smaller

bool holds_marker(const Board& board, Square square, bool legacy) {
  if (board.kind == BoardKind::kPlane) return true;
  const int first = legacy && board.rows % 2 == 0 ? 0 : 1;
  return (square.column + square.row) % 2 == first;
}

double tolerance(std::span<const SeenMarker> markers) {
  double sum = 0;
  for (const SeenMarker& marker : markers) sum += marker.side_px();
  return kToleranceOfSide * sum / static_cast<double>(markers.size());
}

// Markers of which at least three corners agree with one homography of the board.
std::vector<SeenMarker> agreeing(std::span<const SeenMarker> markers, const Board& board, bool legacy) {
  const auto ties = ties_of(board, markers, legacy);
  std::vector<int> corners(markers.size());
  for (const std::size_t tie : consensus(ties, tolerance(markers))) ++corners[tie / 4];
  std::vector<SeenMarker> agreed;
  for (std::size_t i = 0; i < markers.size(); ++i) {
    if (corners[i] >= 3) agreed.push_back(markers[i]);
  }
  return agreed;
}

auto refuse_legacy() {
  return fail(ErrorCode::kMismatch,
              "the board has OpenCV's legacy pattern, with a white top left square, as drawn before OpenCV 4.6; print "
              "one with slsd --print-board, or one with an odd number of rows");
}

auto refuse_layout(const Board& board) {
  return fail(ErrorCode::kMismatch, "the picture shows another board: its markers are of " +
                                        std::string(board.family->name) + ", but not where " + describe(board) +
                                        " has them; give the board that was printed");
}

auto refuse_strangers(int stranger, const Board& board) {
  return fail(ErrorCode::kMismatch, "the picture shows another board: it has the marker " + std::to_string(stranger) +
                                        " of " + std::string(board.family->name) + ", but " + describe(board) +
                                        " has only those below " + std::to_string(board.marker_count()) +
                                        "; give the board that was printed");
}

}  // namespace

Square square_of_marker(const Board& board, int id, bool legacy) {
  if (board.kind == BoardKind::kPlane) return {id % board.columns, id / board.columns};
  Square square;
  for (int left = id; square.row < board.rows; ++square.row) {
    for (square.column = 0; square.column < board.columns; ++square.column) {
      if (holds_marker(board, square, legacy) && left-- == 0) return square;
    }
  }
  return square;
}

std::optional<int> marker_in_square(const Board& board, Square square) {
  const bool inside = square.column >= 0 && square.row >= 0 && square.column < board.columns && square.row < board.rows;
  if (!inside || !holds_marker(board, square, false)) return std::nullopt;
  const int before = square.row * board.columns + square.column;
  return board.kind == BoardKind::kPlane ? before : before / 2;
}

std::array<Eigen::Vector2d, 4> marker_corners(const Board& board, Square square) {
  const double gap = (board.pitch_mm - board.mark_mm) / 2;
  const Eigen::Vector2d first(square.column * board.pitch_mm + gap, square.row * board.pitch_mm + gap);
  const double side = board.mark_mm;
  return {first, first + Eigen::Vector2d(side, 0), first + Eigen::Vector2d(side, side),
          first + Eigen::Vector2d(0, side)};
}

std::vector<Tie> ties_of(const Board& board, std::span<const SeenMarker> markers, bool legacy) {
  std::vector<Tie> ties;
  for (const SeenMarker& marker : markers) {
    const auto corners = marker_corners(board, square_of_marker(board, marker.id, legacy));
    for (std::size_t i = 0; i < corners.size(); ++i) ties.push_back({corners[i], marker.corners[i]});
  }
  return ties;
}

Result<std::vector<SeenMarker>> markers_of_board(const std::vector<SeenMarker>& seen, const Board& board) {
  std::vector<SeenMarker> own;
  std::ranges::copy_if(seen, std::back_inserter(own), [&](const auto& m) { return m.id < board.marker_count(); });
  const std::size_t strangers = seen.size() - own.size();
  if (strangers > own.size()) return refuse_strangers(seen.back().id, board);
  if (own.empty()) return own;
  const auto agreed = agreeing(own, board, false);
  if (board.kind == BoardKind::kCharuco && agreeing(own, board, true).size() > agreed.size()) return refuse_legacy();
  if (10 * agreed.size() < kLeastTenths * own.size()) return refuse_layout(board);
  if (strangers > 1 && strangers * 4 > own.size()) return refuse_strangers(seen.back().id, board);
  return agreed;
}

}  // namespace slsd
