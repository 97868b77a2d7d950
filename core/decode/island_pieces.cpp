// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
// Pieces at an island's rim that another surface may have lent it: docs/decoder.md.
#include <algorithm>
#include <cmath>
#include <span>

#include "core/decode/islands.hpp"

namespace slsd {

/// How far a link's step is from the one behind it, in cells.
float IslandJudge::bend_of(const Frame& frame, std::int32_t node, Direction d) const {
  const std::int32_t other = frame.beside[node][d];
  const std::int32_t next = frame.beside[other][d];
  if (next < 0 || links_[other][d] != Link::kAgrees) return 0;
  const Eigen::Vector2f own = frame.nodes[other].centre_px - frame.nodes[node].centre_px,
                        behind = frame.nodes[next].centre_px - frame.nodes[other].centre_px;
  return (own - behind).norm() / behind.norm();
}

/// Whether a link leads to what is none of the island: its letter contradicts, or is well seen and has been refused.
bool IslandJudge::is_of_another(const Frame& frame, std::int32_t node, Direction d) const {
  constexpr float kWellSeen = 3;
  if (links_[node][d] != Link::kNeutral) return links_[node][d] == Link::kAgainst;
  const Classification& shape = frame.shapes[frame.beside[node][d]];
  return !continues(frame, node, d) && shape.letter >= 0 && shape.distance < kWellSeen;
}

IslandJudge::Side IslandJudge::side_of(const Frame& frame, const Piece& piece, Direction d) const {
  const bool along_row = d == kUp || d == kDown;
  Side side;
  for (int i = 0; i < (along_row ? piece.columns : piece.rows); ++i) {
    const int row = along_row ? piece.row + (d == kDown ? piece.rows - 1 : 0) : piece.row + i,
              column = along_row ? piece.column + i : piece.column + (d == kRight ? piece.columns - 1 : 0);
    const std::int32_t node = holder_[index_of(row, column)];
    if (links_[node][d] == Link::kAgrees) side.bend += bend_of(frame, node, d), ++side.held_by;
    const Beyond cell(frame.claims[node], d);
    side.contradicted |= shown(cell.row, cell.column) && is_of_another(frame, node, d);
    side.broken |= frame.nodes[node].broken[d];
  }
  return side;
}

/// Whether a piece of an island may be of another surface: one whose rim is straight, or turns once, so that the island
/// holds the piece on one side or on two that meet. Something else lies beside it, or breaks off beside it while what
/// holds the piece is bent.
bool IslandJudge::may_be_apart(const Frame& frame, const Piece& piece) const {
  constexpr float kBent = 0.06F;  // surfaces bend by a third of it and less
  std::array<Side, 4> sides;
  for (const Direction d : kAllDirections) sides[d] = side_of(frame, piece, d);
  const auto held = [&](Direction d) { return sides[d].held_by > 0; };
  if ((held(kLeft) && held(kRight)) || (held(kUp) && held(kDown))) return false;
  float bend = 0, links = 0;
  bool contradicted = false, broken = false;
  for (const Side& side : sides) {
    bend += side.bend, links += static_cast<float>(side.held_by);
    contradicted |= side.contradicted && side.held_by == 0;
    broken |= side.broken && side.held_by == 0;
  }
  return contradicted || (broken && bend > kBent * links);
}

/// How often the edge of an island turns at the corner above and to the left of a cell.
int IslandJudge::turns_at(int row, int column, const Piece* without) const {
  const auto member = [&](int r, int c) {
    return shown(r, c) && holder_[index_of(r, c)] >= 0 && (without == nullptr || !without->contains(r, c));
  };
  const bool above_left = member(row - 1, column - 1), above_right = member(row - 1, column),
             below_left = member(row, column - 1), below_right = member(row, column);
  const int count = above_left + above_right + below_left + below_right;
  if (count == 2) return above_left == below_right ? 2 : 0;
  return count % 2;
}

/// How much oftener the edge of the island turns without a piece.
int IslandJudge::turns_without(const Piece& piece) const {
  int turns = 0;
  for (int row = piece.row; row <= piece.row + piece.rows; ++row)
    for (int column = piece.column; column <= piece.column + piece.columns; ++column)
      turns += turns_at(row, column, &piece) - turns_at(row, column, nullptr);
  return turns;
}

/// The evidence of cells for their island; nothing where one of them is none of it.
std::optional<float> IslandJudge::evidence_of(const Piece& piece) const {
  float sum = 0;
  for (int row = piece.row; row < piece.row + piece.rows; ++row) {
    for (int column = piece.column; column < piece.column + piece.columns; ++column) {
      const std::int32_t node = shown(row, column) ? holder_[index_of(row, column)] : -1;
      if (node < 0) return std::nullopt;
      sum += own_ratio(node);
    }
  }
  return sum;
}

/// Refuses a piece that may be of another surface and says too little for being of this one.
void IslandJudge::cut_piece(const Frame& frame, const Piece& piece, float missing) {
  if (!may_be_apart(frame, piece)) return;
  // Where the surface has a corner, another that had it would have to turn as often as an edge is overlooked.
  if (missing <= link_weight_ && turns_without(piece) > 0) return;
  for (int row = piece.row; row < piece.row + piece.rows; ++row)
    for (int column = piece.column; column < piece.column + piece.columns; ++column)
      cut_[holder_[index_of(row, column)]] = 1;
}

/// Looks at every piece along a row or a column, so many cells wide, that holds a node and might lack evidence.
void IslandJudge::cut_pieces_through(const Frame& frame, std::int32_t node, float evidence_min) {
  constexpr int kWidest = 3;
  const int row = frame.claims[node].row, column = frame.claims[node].column;
  for (const bool along_row : {true, false}) {
    const int along = along_row ? column : row, across = along_row ? row : column;
    const auto slice = [&](int first_across, int width, int at) {
      return along_row ? Piece{first_across, at, width, 1} : Piece{at, first_across, 1, width};
    };
    for (int width = 1; width <= kWidest; ++width) {
      for (int side = across - width + 1; side <= across; ++side) {
        float before = 0;
        for (int first = along;; --first) {
          const auto added = evidence_of(slice(side, width, first));
          if (!added || (before += *added) >= evidence_min) break;
          float evidence = before;
          for (int last = along;;) {
            const int length = last - first + 1;
            cut_piece(frame, along_row ? Piece{side, first, width, length} : Piece{first, side, length, width},
                      evidence_min - evidence);
            const auto next = evidence_of(slice(side, width, ++last));
            if (!next || (evidence += *next) >= evidence_min) break;
          }
        }
      }
    }
  }
}

void IslandJudge::cut_pieces(const Frame& frame) {
  queue_.clear();
  std::ptrdiff_t rim = 1;  // links across which chance could have led on
  for (const std::int32_t node : members_) {
    if (links_[node] == kAllAgree) continue;
    const auto ends = std::ranges::count_if(
        kAllDirections, [&](Direction d) { return frame.nodes[node].broken[d] || is_of_another(frame, node, d); });
    if (ends > 0) queue_.push_back(node);
    rim += ends;
  }
  if (queue_.empty()) return;
  const auto evidence_min = static_cast<float>(std::log(static_cast<double>(rim) / options_.wrong_cells_max));
  holder_.assign(static_cast<std::size_t>(options_.rows) * options_.columns, -1);
  for (std::size_t i = 0; i < queue_.size();) {  // island by island, as members are
    const std::int32_t id = island_of_[queue_[i]];
    const auto members = std::span(members_).subspan(islands_[id].first, islands_[id].size);
    for (const std::int32_t node : members) holder_[index_of(frame.claims[node].row, frame.claims[node].column)] = node;
    for (; i < queue_.size() && island_of_[queue_[i]] == id; ++i) cut_pieces_through(frame, queue_[i], evidence_min);
    for (const std::int32_t node : members) holder_[index_of(frame.claims[node].row, frame.claims[node].column)] = -1;
  }
}

}  // namespace slsd
