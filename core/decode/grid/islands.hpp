// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "core/code/pattern.hpp"
#include "core/decode/grid/cell_claim.hpp"
#include "core/decode/grid/cell_gate.hpp"
#include "core/decode/grid/link_grid.hpp"
#include "core/decode/grid/neighbourhood.hpp"
#include "core/decode/symbols/classify.hpp"

namespace slsd {

/// What may go wrong, and what it is weighed by. docs/decoder.md derives each.
struct IslandOptions {
  int rows = 0, columns = 0;        ///< of the part of the array that is shown
  double wrong_cells_max = 0.001;   ///< in expectation, in a frame
  double link_crosses = 1.0 / 150;  ///< share of links that lead across an edge in depth without being broken for it
  Rules rules = {};
};

/// Says which of the cells that were proposed for a frame's nodes are certain.
///
/// An island is a set of linked nodes whose cells lie beside each other as the nodes do. Its symbols speak for it once
/// each: the sum of their log-likelihood ratios against chance. That has to outweigh
///
/// - every other place on the epipolar lines where the island fits, letter by letter;
/// - what choosing it has cost: which nodes of the frame it is made of, and where along its rim it ends although links
///   lead on:     cost = log nodes + log places + 3 a straight piece of the rim + 0.1 a link of it
/// - the budget: log (its nodes / wrong cells in a frame).
///
/// Within an island a node has to be held by two links more than contradict it, and where the line of nodes through it
/// is contradicted, the part of the line that agrees has to reach the budget by itself: so chance adds no node of
/// another surface to a rim, and two rows at one depth name no row between them at another. The same is asked of each
/// piece at a rim that another surface may have taken from the island: see docs/decoder.md.
/// @thread thread-bound: keeps its buffers
class IslandJudge {
 public:
  IslandJudge(const Pattern& pattern, IslandOptions options);

  /// @param claims  in: cells as proposed, or none; out: with the reason where it is rejected
  void judge(const std::vector<GridNode>& nodes, const std::vector<Beside>& beside,
             const std::vector<Classification>& shapes, const CellGate& gate, Executor& executor,
             std::vector<CellClaim>& claims);

 private:
  /// What a link says of the cell of the node that it leads from.
  enum class Link : std::uint8_t { kNone, kAgrees, kNeutral, kAgainst };
  using Links = std::array<Link, 4>;
  /// A shape speaks against a cell where it is so much likelier to be chance; a damaged one says nothing.
  static constexpr float kSpeaksAgainst = -1.5F;
  static constexpr Links kAllAgree{Link::kAgrees, Link::kAgrees, Link::kAgrees, Link::kAgrees};
  [[nodiscard]] static bool any_against(const Links& links);
  struct Island {
    std::int32_t first = 0, size = 0;        // of members_
    DecodeRule rule = DecodeRule::kWindows;  // that refuses it, or kWindows
    [[nodiscard]] bool stands() const { return rule == DecodeRule::kWindows; }
  };

  /// Cells of an island.
  struct Piece {
    int row, column, rows, columns;
    [[nodiscard]] bool contains(int r, int c) const {
      return r >= row && r < row + rows && c >= column && c < column + columns;
    }
  };
  /// The line of nodes through one of them: its evidence, and from where to where all agree with what evidence.
  struct Line {
    std::int32_t node, first, last;
    float evidence, agreeing;
    DecodeRule rule;  // that looks at it
  };
  struct Side {
    int held_by = 0;   // links of the island's
    float bend = 0;    // their sum
    float beyond = 0;  // what doubtful shapes there say for being the island's
    bool contradicted = false;
  };

  struct Frame {
    const std::vector<GridNode>& nodes;
    const std::vector<Beside>& beside;
    const std::vector<Classification>& shapes;
    const CellGate& gate;
    std::vector<CellClaim>& claims;
  };

  /// Log-likelihood ratio of a node's shape against chance, were it that cell's.
  [[nodiscard]] float ratio(const Frame& frame, std::int32_t node, int row, int column) const;
  /// The same were it its own, which it is asked for most.
  [[nodiscard]] float own_ratio(std::int32_t node) const { return own_[node].ratio; }
  [[nodiscard]] bool shown(int row, int column) const {
    return row >= 0 && column >= 0 && row < options_.rows && column < options_.columns;
  }
  void grow(const Frame& frame);
  bool adopt(const Frame& frame, std::int32_t node, CellClaim& adopted) const;
  void look_at_own_cells(const Frame& frame, std::size_t first, std::size_t last);
  void find_islands(const Frame& frame);
  void read_links(const Frame& frame, Executor& executor);
  void read_links_of(const Frame& frame, std::int32_t node);
  void read_links_around(const Frame& frame, const std::vector<std::int32_t>& gone);
  /// Whether a link leads to the node of the same island whose cell lies there.
  [[nodiscard]] bool continues(const Frame& frame, std::int32_t node, Direction direction) const {
    return own_[node].fits[direction] && island_of_[frame.beside[node][direction]] == island_of_[node];
  }
  void drop_rejected(const Frame& frame);
  void part_islands(const Frame& frame, Executor& executor);
  [[nodiscard]] Link read_link_out(const Frame& frame, std::int32_t node, Direction direction) const;
  [[nodiscard]] bool runs_along_edge(const Frame& frame, std::int32_t node, Direction direction) const;
  void weigh(const Frame& frame, Island& island) const;
  [[nodiscard]] double cost_of_rim(const Frame& frame, const Island& island) const;
  void refuse_doubles(const Frame& frame);
  void cut_rims(const Frame& frame);
  void cut_back(const Frame& frame);
  void cut_pieces(const Frame& frame);
  void cut_notches(const Frame& frame, std::int32_t island);
  void cut_steps(const Frame& frame);
  void cut_pieces_through(const Frame& frame, std::int32_t node, float evidence_min);
  void cut_piece(const Frame& frame, const Piece& piece, float missing);
  void cut(std::int32_t node, DecodeRule rule);
  /// The rule by which a piece may be of another surface, or nothing.
  [[nodiscard]] std::optional<DecodeRule> may_be_apart(const Frame& frame, const Piece& piece) const;
  [[nodiscard]] bool is_of_another(const Frame& frame, std::int32_t node, Direction d) const;
  template <class Visit>
  bool any_along(const Piece& piece, Direction d, Visit&& visit) const;
  /// Whether the island goes on beyond that side.
  [[nodiscard]] bool is_held(const Piece& piece, Direction d) const;
  [[nodiscard]] Side side_of(const Frame& frame, const Piece& piece, Direction d) const;
  [[nodiscard]] float bend_of(const Frame& frame, std::int32_t node, Direction d) const;
  [[nodiscard]] int turns_without(const Piece& piece) const;
  [[nodiscard]] int turns_at(int row, int column, const Piece* without) const;
  [[nodiscard]] std::optional<float> evidence_of(const Piece& piece) const;
  [[nodiscard]] std::size_t index_of(int row, int column) const {
    return static_cast<std::size_t>(row) * options_.columns + column;
  }
  void look_at_cells(const Frame& frame, std::int32_t island);
  [[nodiscard]] std::int32_t& holder_of(const Frame& frame, std::int32_t node) {
    return holder_[index_of(frame.claims[node].row, frame.claims[node].column)];
  }
  /// Whether the island that is looked at has a node there.
  [[nodiscard]] bool is_left(int row, int column) const {
    return shown(row, column) && holder_[index_of(row, column)] >= 0;
  }
  [[nodiscard]] std::optional<float> slip_beyond(const Frame& frame, std::int32_t node, Direction d) const;
  [[nodiscard]] std::optional<float> slip_from_within(const Frame& frame, std::int32_t node, Direction inwards) const;
  void measure_slips(const Frame& frame);
  /// Whether a node is farther off its epipolar line than whole symbols are.
  [[nodiscard]] bool is_off_line(std::int32_t node) const {
    return std::abs(own_[node].off_line_px) > off_line_max_px_;
  }
  [[nodiscard]] bool are_off_line(const Frame& frame, int from, int to);
  [[nodiscard]] GridFit grid_fit(const Frame& frame, std::int32_t node) const;
  /// Up to which slip a link fits the grid tightly.
  [[nodiscard]] float tight_slip() const { return std::min(0.5F * slip_max_, kTightSlip); }
  /// Whether a link leads to what is not on one surface with the node.
  [[nodiscard]] bool parts(const Frame& frame, std::int32_t node, Direction d) const {
    if (std::isinf(slip_max_)) return false;
    const auto slip = slip_beyond(frame, node, d);
    return slip && std::abs(*slip) > slip_max_;
  }
  void cut_slid(const Frame& frame, std::int32_t island);
  void cut_slid_along(const Frame& frame, std::int32_t island, const Piece& line);
  void cut_contradicted_lines(const Frame& frame);
  [[nodiscard]] bool is_off_grid(const Frame& frame, Direction forth, int from, int to);
  [[nodiscard]] float evidence_of_places(const Frame& frame, Direction forth, int from, int to) const;
  void find_contradicted_lines(const Frame& frame, Direction forth, float evidence_min);
  [[nodiscard]] float evidence_against_slides(const Frame& frame, int from, int to);
  [[nodiscard]] bool fits_between(const Frame& frame, const Line& line, float evidence_min);
  [[nodiscard]] float count_doubtful(const Frame& frame, std::int32_t node, Direction direction, int most) const;

  CodeArray array_;
  IslandOptions options_;
  float log_letters_, link_weight_, pitch_px_;
  /// What a node's own cell is to it, once all have one.
  struct Own {
    float ratio;        // as above; 0 without a cell
    float off_line_px;  // to which side of its epipolar line it lies, and how far, projector px
    bool on_line, admitted;
    std::array<bool, 4> fits;  // whether the neighbour's cell lies beside it as the neighbour does
  };
  std::vector<Own> own_;
  std::vector<std::int32_t> island_of_;  // -1: none
  std::vector<Island> islands_;
  std::vector<std::int32_t> members_, queue_, next_queue_;
  std::vector<Links> links_;
  std::vector<CellClaim> adopted_;
  std::vector<std::uint8_t> cut_;              // of each node, whether a rule has cut it
  std::vector<DecodeRule> cut_by_;             // and which was the first
  std::vector<std::int8_t> held_;              // by so many links more than contradict
  std::vector<std::int32_t> line_;             // of nodes
  std::vector<double> line_ratios_;            // their sums before each of them
  std::vector<float> own_ratios_;              // of line_
  std::vector<std::optional<float>> beyond_;   // evidence of slices of pieces
  std::vector<std::int32_t> around_, placed_;  // the node of each cell of an island and beside it; where one is
  std::vector<std::uint8_t> unlikely_rows_, unlikely_columns_;  // which hold what is hardly its cell's letter
  std::vector<std::array<int, 2>> slides_;  // rows and columns of each step along the epipolar lines
  std::vector<float> slid_ratios_;          // of line_ after each of them, summed up as line_ratios_
  std::vector<Line> lines_;                 // contradicted ones
  std::vector<std::int32_t> holder_;        // of each cell: of the island that is looked at, or of all
  std::int32_t looked_at_ = -1;
  std::vector<float> slips_;         // of a sample of links, or of those across a line
  float slip_max_ = 0;               // of links on one surface, cells
  std::vector<float> off_lines_px_;  // of a sample of nodes, or of those of a line
  float off_line_max_px_ = 0;        // of whole symbols
};

}  // namespace slsd
