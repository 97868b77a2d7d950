// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/inference/edge_prior.hpp"

#include <algorithm>
#include <cmath>

namespace slsd {
namespace {

constexpr float kContradicts = -2;     // nats of a shape for the cell that a link leads to
constexpr float kSplitIsCut = 0.5F;    // links to split symbols that lead across an edge
constexpr float kMissingIsCut = 0.2F;  // places of the grid where nothing is seen
constexpr float kUsualCounts = 0.5F;   // links that the share of the whole frame counts as
constexpr float kShareMin = 0.001F, kUsualMax = 0.3F, kShareMax = 0.4F;
constexpr int kSpreadLinks = 4;  // links

bool contradicts(const NodesSeen& seen, const LetterEvidence& letters, std::int32_t from, std::int32_t to,
                 Direction d) {
  const std::int32_t cell = seen.labels[from];
  if (cell < 0) return false;
  const std::int32_t there = letters.grid().beyond(cell, d);
  return seen.labels[to] != there && (there < 0 || letters.of(to, there) < kContradicts);
}

}  // namespace

void EdgePrior::find_cut(const NodesSeen& seen, const LetterEvidence& letters, Executor& executor) {
  cut_.assign(seen.nodes.size(), {});
  executor.run_ranges(seen.nodes.size(), [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) {
      const auto node = static_cast<std::int32_t>(i);
      for (const Direction d : kDirections) {
        const std::int32_t other = seen.nodes[i].links[d];
        if (other < 0) continue;
        cut_[i][d] = seen.nodes[i].broken[d] || contradicts(seen, letters, node, other, d) ||
                     contradicts(seen, letters, other, node, opposite(d));
      }
    }
  });
}

void EdgePrior::spread(const NodesSeen& seen, Executor& executor) {
  constexpr float kOfFive = 0.2F;
  next_ = counts_;
  executor.run_ranges(counts_.size(), [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) {
      Count& sum = next_[i];
      for (const Direction d : kDirections) {
        const std::int32_t other = seen.nodes[i].links[d];
        if (other < 0) continue;
        for (const int along : {0, 1})
          sum.links[along] += counts_[other].links[along], sum.cut[along] += counts_[other].cut[along];
      }
      for (const int along : {0, 1}) sum.links[along] *= kOfFive, sum.cut[along] *= kOfFive;
    }
  });
  counts_.swap(next_);
}

void EdgePrior::measure(const NodesSeen& seen, const LetterEvidence& letters, Executor& executor) {
  find_cut(seen, letters, executor);
  counts_.assign(seen.nodes.size(), {});
  float links = 2, cut = 1;  // pseudo-counts
  for (std::size_t i = 0; i < seen.nodes.size(); ++i) {
    for (const Direction d : kDirections) {
      const std::int32_t other = seen.nodes[i].links[d];
      if (other < 0) {
        if (letters.grid().beyond(seen.labels[i], d) >= 0)
          counts_[i].links[d % 2] += 1, counts_[i].cut[d % 2] += kMissingIsCut;
        continue;
      }
      const bool own = seen.nodes[i].broken[d] || contradicts(seen, letters, static_cast<std::int32_t>(i), other, d);
      if (seen.aligned[i] == Aligned::kPrinted || seen.aligned[other] == Aligned::kPrinted) continue;
      const float share = own ? 1 : seen.nodes[other].split ? kSplitIsCut : 0;
      counts_[i].links[d % 2] += 1, counts_[i].cut[d % 2] += share;
      links += 1, cut += share;
    }
  }
  const float usual_share = std::clamp(cut / links, kShareMin, kUsualMax);
  for (int link = 0; link < kSpreadLinks; ++link) spread(seen, executor);
  odds_.resize(counts_.size());
  for (std::size_t i = 0; i < counts_.size(); ++i)
    for (const std::size_t along : {0, 1})
      odds_[i][along] = odds_of(counts_[i].links[along], counts_[i].cut[along], usual_share);
}

float EdgePrior::odds_of(float links, float cut, float usual_share) {
  const float share = std::clamp((cut + kUsualCounts * usual_share) / (links + kUsualCounts), kShareMin, kShareMax);
  return std::log((1 - share) / share);
}

}  // namespace slsd
