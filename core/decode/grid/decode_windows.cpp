// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/grid/decode_windows.hpp"

#include <algorithm>
#include <cmath>

namespace slsd {
namespace {

constexpr int kExactWeight = 2;
constexpr int kCorrectedWeight = 1;

}  // namespace

WindowDecoder::WindowDecoder(const Pattern& pattern, std::shared_ptr<const Codebook> codebook, double wrong_cells_max,
                             Rules rules)
    : array_(pattern.array),
      codebook_(std::move(codebook)),
      unique_(pattern.array.minimum_distance > 0),
      corrects_(pattern.array.minimum_distance >= 3),
      log_letters_(std::log(static_cast<float>(pattern.letters()))),
      rules_(rules),
      judge_(pattern, {.rows = codebook_->rows(),
                       .columns = codebook_->columns(),
                       .wrong_cells_max = wrong_cells_max,
                       .rules = rules}) {}

/// Of the nine letters around a node; Codebook::kNoKey where one is not known.
std::uint32_t WindowDecoder::key_of(const Neighbourhood& around) const {
  std::uint32_t key = 0;
  int all = 0;  // below zero once one is
  for (const std::int32_t node : around) {
    const std::int8_t letter = letters_[node + 1];
    all |= letter;
    key = codebook_->append(key, static_cast<std::uint8_t>(letter));
  }
  return all < 0 ? Codebook::kNoKey : key;
}

/// Where the window above, or the one to the left, was found, this one lies beside it: one comparison instead of a
/// search, as long as no other window is like it.
/// @param first  from which node on there are hits
WindowDecoder::Hit WindowDecoder::continued(std::int32_t node, std::uint32_t key, std::int32_t first) const {
  if (!unique_) return {};
  constexpr int kAbove = 1, kLeftOf = 3;
  for (const int beside : {kAbove, kLeftOf}) {
    const std::int32_t other = around_[node][beside];
    if (other < first || other >= node) continue;
    const Hit& hit = hits_[other];
    const int row = hit.row + (beside == kAbove), column = hit.column + (beside == kLeftOf);
    if (hit.weight == 0 || codebook_->key_at(row, column) != key) continue;
    return {static_cast<std::int16_t>(row), static_cast<std::int16_t>(column), kExactWeight};
  }
  return {};
}

WindowDecoder::Hit WindowDecoder::look_up(std::int32_t node, std::uint32_t key, const CellGate& gate) const {
  Hit found;
  int hits = 0;
  const auto take = [&](const Codebook::Entry& entry, int weight, bool strays) {
    found = {entry.row, entry.column, weight, strays};
    ++hits;
  };
  const auto take_admitted = [&](const Codebook::Entry& entry, int weight) {
    if (gate.admits(node, entry.row, entry.column)) take(entry, weight, false);
  };
  codebook_->find(key, [&](const Codebook::Entry& entry) { take_admitted(entry, kExactWeight); });
  if (hits == 1) return found;
  // Light of the pattern that comes from elsewhere than the calibration says: of a knocked rig, of another projector.
  if (hits == 0 && unique_) {
    codebook_->find(key, [&](const Codebook::Entry& entry) { take(entry, kExactWeight, true); });
  }
  if (hits == 0 && corrects_)
    codebook_->find_one_off(key, [&](const Codebook::Entry& entry) { take_admitted(entry, kCorrectedWeight); });
  return hits == 1 ? found : Hit{};
}

/// Of a range of nodes.
void WindowDecoder::look_up_windows(std::int32_t first, std::int32_t last, const CellGate& gate) {
  for (std::int32_t node = first; node < last; ++node) {
    Hit& hit = hits_[node] = {};
    const std::uint32_t key = key_of(around_[node]);
    if (key == Codebook::kNoKey) continue;
    hit = continued(node, key, first);
    if (hit.weight == 0) {
      hit = look_up(node, key, gate);
    } else {
      hit.strays = !gate.admits(node, hit.row, hit.column);
    }
  }
}

void WindowDecoder::vote(std::int32_t node, const Vote& vote, bool strays, const CellGate& gate, Ballot& ballot) const {
  for (int i = 1; i < ballot.count; ++i) {
    if (ballot.votes[i].row != vote.row || ballot.votes[i].column != vote.column) continue;
    ballot.votes[i].weight += vote.weight;
    return;
  }
  if (ballot.count == kVotes || !shown(vote.row, vote.column)) return;
  if (!strays && !gate.admits(node, vote.row, vote.column)) return;
  ballot.votes[ballot.count++] = vote;
}

/// The votes of the windows that hold a node: of those around the nodes around it.
WindowDecoder::Ballot WindowDecoder::collect_votes(std::int32_t node, const CellGate& gate) const {
  Ballot ballot;
  Vote& first = ballot.votes[0];
  for (int i = 0; i < kWindowCells; ++i) {
    const std::int32_t other = around_[node][i];
    if (other < 0 || hits_[other].weight == 0) continue;
    // A corner can be reached from here and not lead back.
    if (around_[other][kWindowCells - 1 - i] != node) continue;
    const Hit& hit = hits_[other];
    const Vote next{hit.row + 1 - i / kWindowSide, hit.column + 1 - i % kWindowSide, hit.weight};
    if (ballot.count > 0 && first.row == next.row && first.column == next.column) {
      first.weight += next.weight;
    } else {
      vote(node, next, hit.strays, gate, ballot);
    }
  }
  return ballot;
}

/// Whether the windows around a node name the cell that its own does: there is nothing to count then.
bool WindowDecoder::is_unanimous(std::int32_t node) const {
  const Hit& own = hits_[node];
  if (own.weight == 0 || !shown(own.row, own.column)) return false;
  bool unanimous = true;
  for (int i = 0; i < kWindowCells; ++i) {
    const std::int32_t other = around_[node][i];
    const Hit& hit = hits_[other < 0 ? node : other];
    const int row = own.row - 1 + i / kWindowSide, column = own.column - 1 + i % kWindowSide;
    unanimous &= other < 0 || hit.weight == 0 || (hit.row == row && hit.column == column);
  }
  return unanimous;
}

void WindowDecoder::elect(std::int32_t node, const CellGate& gate, CellClaim& claim) const {
  if (is_unanimous(node)) {
    claim = {hits_[node].row, hits_[node].column};
    claim.decide(DecodeRule::kWindows);
    return;
  }
  const Ballot ballot = collect_votes(node, gate);
  claim = {};
  const bool linked = std::ranges::count_if(around_[node], [](std::int32_t other) { return other >= 0; }) > 1;
  claim.decide(linked ? DecodeRule::kNoWindow : DecodeRule::kNoNeighbour);
  int best = 0, second = 0;
  for (int i = 0; i < ballot.count; ++i) {
    const int weight = ballot.votes[i].weight;
    if (weight > best) {
      second = best;
      best = weight;
      claim.row = static_cast<std::int16_t>(ballot.votes[i].row);
      claim.column = static_cast<std::int16_t>(ballot.votes[i].column);
    } else {
      second = std::max(second, weight);
    }
  }
  if (best == 0) return;
  claim.decide(DecodeRule::kWindows);
  if (!rules_.apply(DecodeRule::kWindowsDisagree, 2 * second > best)) return;
  claim = {};
  claim.decide(DecodeRule::kWindowsDisagree);
}

/// Weighs the claims on cells that are claimed more than once: the log-likelihood of each window's shapes against
/// chance.
void WindowDecoder::weigh_rivals(const std::vector<Classification>& shapes, std::vector<CellClaim>& claims) {
  claimed_.assign(static_cast<std::size_t>(codebook_->rows()) * codebook_->columns(), 0);
  const auto claimed = [&](const CellClaim& claim) -> std::uint8_t& {
    return claimed_[static_cast<std::size_t>(claim.row) * codebook_->columns() + claim.column];
  };
  bool rivals = false;
  for (const CellClaim& claim : claims) {
    if (claim.status != RegionStatus::kDecoded) continue;
    rivals |= claimed(claim) != 0;
    claimed(claim) = claimed(claim) == 0 ? 1 : 2;
  }
  if (!rivals) return;
  for (std::size_t node = 0; node < claims.size(); ++node) {
    CellClaim& claim = claims[node];
    if (claim.status != RegionStatus::kDecoded || claimed(claim) < 2) continue;
    for (int i = 0; i < kWindowCells; ++i) {
      const std::int32_t other = around_[node][i];
      const int row = claim.row - 1 + i / kWindowSide, column = claim.column - 1 + i % kWindowSide;
      if (other < 0 || shapes[other].letter < 0 || !shown(row, column)) continue;
      claim.evidence += shapes[other].log_probability[array_.at(row, column)] + log_letters_;
    }
  }
}

void WindowDecoder::decode(const std::vector<GridNode>& nodes, const std::vector<Classification>& shapes,
                           const CellGate& gate, Executor& executor, std::vector<CellClaim>& claims) {
  around_.resize(nodes.size());
  hits_.resize(nodes.size());
  claims.resize(nodes.size());
  find_beside(nodes, beside_);
  letters_.assign(1, -1);
  for (const Classification& shape : shapes) letters_.push_back(shape.letter);
  constexpr std::size_t kRange = 768;  // some rows of windows: most continue one of their range
  executor.run_ranges(
      nodes.size(),
      [&](std::size_t first, std::size_t last, int) {
        for (std::size_t i = first; i < last; ++i) around_[i] = neighbourhood(beside_, static_cast<std::int32_t>(i));
        look_up_windows(static_cast<std::int32_t>(first), static_cast<std::int32_t>(last), gate);
      },
      kRange);
  executor.run_ranges(nodes.size(), [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) elect(static_cast<std::int32_t>(i), gate, claims[i]);
  });
  judge_.judge(nodes, beside_, shapes, gate, executor, claims);
  weigh_rivals(shapes, claims);
}

}  // namespace slsd
