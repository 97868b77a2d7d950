// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/decode_windows.hpp"

#include <algorithm>
#include <cmath>

namespace slsd {
namespace {

constexpr int kExactWeight = 2;
constexpr int kCorrectedWeight = 1;
constexpr int kSpreadRounds = 3;
constexpr float kCornerSymbols = 3.6F;  // of four, as none is certain

}  // namespace

WindowDecoder::WindowDecoder(const Pattern& pattern, DecodeWindowsOptions options, int radius)
    : array_(pattern.array),
      options_(options),
      exact_codebook_(pattern.array, options.rows, options.columns, 0),
      correcting_codebook_(pattern.array, options.rows, options.columns, radius),
      log_letters_(std::log(static_cast<float>(pattern.letters()))) {}

float WindowDecoder::shape_evidence(const Classification& shape, int row, int column) const {
  if (shape.letter < 0) return 0;
  return std::max(shape.log_probability[array_.at(row, column)] + log_letters_, options_.mismatch);
}

void WindowDecoder::vote(std::int32_t node, int row, int column, int weight, const CellGate& gate) {
  Ballot& ballot = ballots_[node];
  for (int i = 0; i < ballot.count; ++i) {
    if (ballot.votes[i].row != row || ballot.votes[i].column != column) continue;
    ballot.votes[i].weight = static_cast<std::int16_t>(ballot.votes[i].weight + weight);
    return;
  }
  if (ballot.count == kVotes || !shown(row, column) || !gate.admits(node, row, column)) return;
  ballot.votes[ballot.count++] = {static_cast<std::int16_t>(row), static_cast<std::int16_t>(column),
                                  static_cast<std::int16_t>(weight)};
}

std::optional<Codebook::Entry> WindowDecoder::look_up(std::int32_t node, const Codeword& codeword,
                                                      const CellGate& gate) const {
  std::optional<Codebook::Entry> hit;
  int hits = 0;
  const auto take = [&](const Codebook::Entry& entry) {
    if (gate.admits(node, entry.row, entry.column)) hit = entry, ++hits;
  };
  exact_codebook_.find(codeword, take);
  if (hits == 0) correcting_codebook_.find(codeword, take);
  return hits == 1 ? hit : std::nullopt;
}

void WindowDecoder::look_up_windows(const std::vector<Classification>& shapes, const CellGate& gate) {
  for (std::size_t node = 0; node < around_.size(); ++node) {
    const Neighbourhood& around = around_[node];
    Codeword codeword;
    bool full = true;
    for (int i = 0; i < kWindowCells && full; ++i) {
      full = around[i] >= 0 && shapes[around[i]].letter >= 0;
      if (full) codeword[i] = static_cast<std::uint8_t>(shapes[around[i]].letter);
    }
    if (!full) continue;
    const auto hit = look_up(static_cast<std::int32_t>(node), codeword, gate);
    if (!hit) continue;
    const int weight = hit->errors == 0 ? kExactWeight : kCorrectedWeight;
    for (int i = 0; i < kWindowCells; ++i) {
      vote(around[i], hit->row - 1 + i / kWindowSide, hit->column - 1 + i % kWindowSide, weight, gate);
    }
  }
}

void WindowDecoder::elect(std::vector<CellClaim>& claims) const {
  for (std::size_t node = 0; node < claims.size(); ++node) {
    const Ballot& ballot = ballots_[node];
    CellClaim& claim = claims[node];
    claim = {};
    const bool linked = std::ranges::count_if(around_[node], [](std::int32_t other) { return other >= 0; }) > 1;
    claim.status = linked ? RegionStatus::kNoCodeword : RegionStatus::kNoNeighbour;
    int best = 0, second = 0;
    for (int i = 0; i < ballot.count; ++i) {
      const int weight = ballot.votes[i].weight;
      if (weight > best) {
        second = best;
        best = weight;
        claim.row = ballot.votes[i].row;
        claim.column = ballot.votes[i].column;
      } else {
        second = std::max(second, weight);
      }
    }
    if (best == 0) continue;
    claim.status = RegionStatus::kDecoded;
    if (2 * second > best) claim = {-1, -1, 0, RegionStatus::kAmbiguousCodeword};
  }
}

void WindowDecoder::spread(const std::vector<GridNode>& nodes, const CellGate& gate, std::vector<CellClaim>& claims) {
  for (int round = 0; round < kSpreadRounds; ++round) {
    bool changed = false;
    for (std::size_t node = 0; node < claims.size(); ++node) {
      if (claims[node].status != RegionStatus::kNoCodeword) continue;
      CellClaim named;
      for (const Direction d : {kRight, kDown, kLeft, kUp}) {
        const std::int32_t other = neighbour(nodes, static_cast<std::int32_t>(node), d);
        if (other < 0 || !claims[other].named()) continue;
        const Eigen::Vector2f back = step(opposite(d));
        const int row = claims[other].row + static_cast<int>(back.y()),
                  column = claims[other].column + static_cast<int>(back.x());
        if (!shown(row, column) || !gate.admits(static_cast<std::int32_t>(node), row, column)) continue;
        if (named.named() && !named.same_cell(row, column)) {
          named = {-1, -1, 0, RegionStatus::kAmbiguousCodeword};
          break;
        }
        named = {static_cast<std::int16_t>(row), static_cast<std::int16_t>(column), 0, RegionStatus::kDecoded};
      }
      if (!named.named()) continue;
      claims[node] = named;
      changed = true;
    }
    if (!changed) return;
  }
}

void WindowDecoder::verify(const std::vector<Classification>& shapes, std::vector<CellClaim>& claims) const {
  // A corner of the pattern has four symbols to speak for it, each worth the logarithm of the letters.
  const float evidence_min = std::min(options_.evidence_min, kCornerSymbols * log_letters_);
  for (std::size_t node = 0; node < claims.size(); ++node) {
    CellClaim& claim = claims[node];
    if (!claim.named()) continue;
    const Neighbourhood& around = around_[node];
    int for_it = 0, against_it = 0;
    for (int i = 0; i < kWindowCells; ++i) {
      const int row = claim.row - 1 + i / kWindowSide, column = claim.column - 1 + i % kWindowSide;
      if (around[i] < 0 || !shown(row, column)) continue;
      claim.evidence += shape_evidence(shapes[around[i]], row, column);
      if (i == kWindowCells / 2 || !claims[around[i]].named()) continue;
      ++(claims[around[i]].same_cell(row, column) ? for_it : against_it);
    }
    const float own = shapes[node].log_probability[array_.at(claim.row, claim.column)];
    if (shapes[node].letter < 0) {
      claim.status = RegionStatus::kUnknownShape;
    } else if (own < options_.own_class_min) {
      claim.status = RegionStatus::kClassDisagrees;
    } else if (claim.evidence < evidence_min ||
               options_.dissent_max * static_cast<float>(for_it) <= static_cast<float>(against_it)) {
      claim.status = RegionStatus::kNeighboursDisagree;
    }
  }
}

void WindowDecoder::decode(const std::vector<GridNode>& nodes, const std::vector<Classification>& shapes,
                           const CellGate& gate, std::vector<CellClaim>& claims) {
  around_.resize(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) around_[i] = neighbourhood(nodes, static_cast<std::int32_t>(i));
  ballots_.assign(nodes.size(), {});
  claims.assign(nodes.size(), {});
  look_up_windows(shapes, gate);
  elect(claims);
  spread(nodes, gate, claims);
  verify(shapes, claims);
}

}  // namespace slsd
