// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/inference/letter_evidence.hpp"

#include <algorithm>
#include <cmath>

namespace slsd {
namespace {

/// The share of shapes at a distance from their prototype, in standard deviations, that show another letter.
struct Misread {
  float distance_max, share;
};
constexpr std::array kMisread{Misread{2, 0.001F}, Misread{3, 0.01F}, Misread{4, 0.05F},   Misread{6, 0.15F},
                              Misread{8, 0.5F},   Misread{12, 0.8F}, Misread{1e9F, 0.95F}};
/// Shares of doubtful and of split shapes among symbols that an edge cuts.
constexpr float kDoubtfulAtEdges = 0.2F, kSplitAtEdges = 0.5F;

}  // namespace

LetterEvidence::LetterEvidence(const CodeArray& array, CellGrid grid)
    : grid_(grid), letter_count_(static_cast<float>(array.letters)) {
  letters_.reserve(static_cast<std::size_t>(grid.rows) * grid.columns);
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column)
      letters_.push_back(static_cast<std::uint8_t>(array.at(row, column)));
}

/// Aligned and printed symbols are whole, unless an edge may run through them.
LetterEvidence::Wholeness LetterEvidence::wholeness_of(std::size_t node) const {
  if (aligned_[node] != Aligned::kNot) return aligned_[node] == Aligned::kAtEdge ? kSplit : kWhole;
  const Classification& shape = shapes_[node];
  if (shape.is_well_seen()) return kWhole;
  return shape.distance < kSplitDistance ? kDoubtful : kSplit;
}

void LetterEvidence::look_at(std::span<const Classification> shapes, std::span<const Aligned> aligned) {
  shapes_ = shapes, aligned_ = aligned;
  split_nats_ = {};
}

void LetterEvidence::measure_split(std::span<const Beside> beside, std::span<const std::int32_t> labels) {
  constexpr float kAgrees = 1;     // nats
  constexpr float kAsIfSeen = 20;  // symbols, one of them split
  std::array<float, kWholenesses> count{};
  float amid = 0;
  agrees_.resize(labels.size());
  for (std::size_t node = 0; node < labels.size(); ++node)
    agrees_[node] = labels[node] >= 0 && of(static_cast<std::int32_t>(node), labels[node]) > kAgrees;
  for (std::size_t node = 0; node < labels.size(); ++node) {
    const bool is_amid = std::ranges::all_of(kDirections, [&](Direction d) {
      const std::int32_t other = beside[node][d];
      return other >= 0 && agrees_[other] != 0 && labels[other] == grid_.beyond(labels[node], d);
    });
    if (is_amid) ++count[wholeness_of(node)], ++amid;
  }
  const auto nats = [&](Wholeness how, float at_edges) {
    return std::min(0.F, std::log((count[how] + 1) / (amid + kAsIfSeen) / at_edges));
  };
  split_nats_ = {0, nats(kDoubtful, kDoubtfulAtEdges), nats(kSplit, kSplitAtEdges)};
}

float LetterEvidence::of(std::int32_t node, std::int32_t cell) const {
  const Classification& shape = shapes_[static_cast<std::size_t>(node)];
  if (shape.letter < 0) return 0;
  const float share = shape.share_of(letter_of(cell), 1 / letter_count_);
  const float misread =
      std::ranges::find_if(kMisread, [&](const Misread& m) { return shape.distance < m.distance_max; })->share;
  const float split = split_nats_[wholeness_of(static_cast<std::size_t>(node))];
  const float nats = std::log((1 - misread) * share * letter_count_ + misread) + split;
  // A symbol that cannot be aligned at its predicted place may be a different symbol.
  return aligned_[static_cast<std::size_t>(node)] == Aligned::kPrinted ? std::min(0.F, nats) : nats;
}

}  // namespace slsd
