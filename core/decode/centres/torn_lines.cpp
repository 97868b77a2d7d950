// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/torn_lines.hpp"

#include <algorithm>
#include <limits>

#include "core/decode/grid/neighbourhood.hpp"

namespace slsd {
namespace {

constexpr int kFar = 8;  // links to each side

/// Its cell is known, and it is torn or misread, though it may have been mended.
bool is_doubtful(const Sightings& seen, std::int32_t node) {
  const CellClaim& claim = seen.claims[node];
  return claim.named() && (seen.shapes[node].is_torn() || claim.status == RegionStatus::kClassDisagrees);
}

/// Calls visit(other, cells) for those that links lead to one way, also broken ones, as an edge breaks them, and whose
/// cells lie on a node's line, so many cells on.
template <class Visit>
void visit_along(const Sightings& seen, std::int32_t node, Direction d, const Visit& visit) {
  const CellClaim& from = seen.claims[node];
  std::int32_t other = seen.nodes[node].links[d];
  for (int links = 0; links < kFar && other >= 0; ++links, other = seen.nodes[other].links[d]) {
    const CellClaim& to = seen.claims[other];
    const Eigen::Vector2f way(static_cast<float>(to.column - from.column), static_cast<float>(to.row - from.row));
    const float cells = way.dot(step(d));
    if (to.named() && cells > 0 && way == cells * step(d)) visit(other, cells);
  }
}

bool stands(const Sightings& seen, std::int32_t node) {
  return seen.claims[node].status == RegionStatus::kDecoded;
}

}  // namespace

TornLines::TornLines(const Pattern& pattern, std::shared_ptr<const LetterFields> letters, Rules rules)
    : pitch_px_(static_cast<float>(pattern.pitch_px())), rules_(rules), aligner_(pattern, std::move(letters)) {}

/// Whether as many of its line speak against it as stand, itself among them.
/// @param votes  of those that are doubtful: (node) -> bool
template <class Votes>
bool TornLines::is_outvoted(const Sightings& seen, const Suspect& suspect, const Votes& votes) {
  int standing = 1, against = 0;
  for (const Direction d : {suspect.forth, opposite(suspect.forth)}) {
    visit_along(seen, suspect.node, d, [&](std::int32_t other, float) {
      const bool speaks_against = is_doubtful(seen, other) && votes(other);
      against += speaks_against, standing += !speaks_against && stands(seen, other);
    });
  }
  return against >= standing;
}

/// What would be outvoted if all that are doubtful spoke against it.
void TornLines::find_suspects(const Sightings& seen) {
  is_suspect_.assign(seen.size(), 0);
  suspects_.clear();
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto node = static_cast<std::int32_t>(i);
    if (!is_doubtful(seen, node)) continue;
    for (const Direction d : kDirections) {
      visit_along(seen, node, d, [&](std::int32_t other, float) {
        const Direction forth = d == kLeft ? kRight : d == kUp ? kDown : d;
        if (!stands(seen, other) || (is_suspect_[other] & 1 << forth) != 0) return;
        is_suspect_[other] |= static_cast<std::uint8_t>(1 << forth);
        const Suspect suspect{other, forth};
        if (is_outvoted(seen, suspect, [](std::int32_t) { return true; })) suspects_.push_back(suspect);
      });
    }
  }
}

/// A doubtful one is looked for from the nearest that stands.
void TornLines::ask(const LetterScene& scene, std::int32_t node) {
  const Sightings& seen = scene.seen;
  LetterPlace place;
  float nearest = std::numeric_limits<float>::max();
  for (const Direction d : kDirections) {
    visit_along(seen, node, d, [&](std::int32_t other, float cells) {
      if (!stands(seen, other) || cells >= nearest) return;
      nearest = cells;
      const GridNode& from = seen.nodes[other];
      const GreyMoments& light = seen.moments[other];
      place = {from.centre_px - cells * pitch_px_ * (from.frame * step(d)), from.frame, light.background, light.peak,
               1};
    });
  }
  if (place.held_by > 0) aligner_.ask(scene, node, place);
}

/// One round of it.
/// @return  whether anything was refused
bool TornLines::refuse_outvoted(const LetterScene& scene) {
  Sightings& seen = scene.seen;
  find_suspects(seen);
  aligner_.clear();
  for (const Suspect& suspect : suspects_) {
    for (const Direction d : {suspect.forth, opposite(suspect.forth)}) {
      visit_along(seen, suspect.node, d, [&](std::int32_t other, float) {
        if (!is_doubtful(seen, other) || is_asked_[other] != 0) return;
        is_asked_[other] = 1;
        // What is well seen as another letter needs no second look.
        shows_other_light_[other] = seen.shapes[other].is_well_seen();
        if (shows_other_light_[other] == 0) ask(scene, other);
      });
    }
  }
  aligner_.align(scene);
  for (const AskedLetter& asked : aligner_.asked())
    shows_other_light_[asked.node] = aligner_.shows_other_light(scene, asked);
  // All are judged before any is refused.
  std::erase_if(suspects_, [&](const Suspect& suspect) {
    return !is_outvoted(seen, suspect, [&](std::int32_t other) { return shows_other_light_[other] != 0; });
  });
  for (const Suspect& suspect : suspects_) seen.claims[suspect.node].decide(DecodeRule::kOtherLight);
  return !suspects_.empty();
}

void TornLines::refuse(const LetterScene& scene) {
  if (!rules_.has(DecodeRule::kOtherLight)) return;
  is_asked_.assign(scene.seen.size(), 0), shows_other_light_.assign(scene.seen.size(), 0);
  refused_.clear();
  // What is refused stands for the others no longer.
  while (refuse_outvoted(scene)) {
    for (const Suspect& suspect : suspects_) refused_.push_back(suspect.node);
  }
  refuse_left_alone(scene.seen);
}

/// What stood beside them, and has nothing left that does.
void TornLines::refuse_left_alone(Sightings& seen) const {
  for (const std::int32_t node : refused_) {
    for (const std::int32_t other : seen.nodes[node].links) {
      if (other < 0 || !stands(seen, other)) continue;
      const bool alone = std::ranges::all_of(
          kDirections, [&](Direction d) { return decoded_beside(seen.nodes, seen.claims, other, d) < 0; });
      if (rules_.apply(DecodeRule::kLeftAlone, alone)) seen.claims[other].decide(DecodeRule::kLeftAlone);
    }
  }
}

}  // namespace slsd
