// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/mend_symbols.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>

#include "core/decode/centres/align_symbols.hpp"
#include "core/decode/grid/neighbourhood.hpp"

namespace slsd {
namespace {

constexpr int kHeldBy = 2;
/// From where its neighbours put it, and from where it was decoded, of the pitch.
constexpr float kMovedMax = 0.08F;
/// Against kAlignedTiltMaxPx: at a corner of what is decoded the surface may turn away.
constexpr float kTiltAtCornersMaxPx = 1;
/// What one alone holds is tilted less.
constexpr float kLoneTiltMaxPx = 0.25F;
/// Where so much of its middle is brighter than the letter's light, something lies before it.
constexpr float kHidden = 0.5F;
/// From which misfit on, or how far off its line in projector px, what is decoded is aligned, too: whole symbols are
/// nearer to their letters and to their lines. Its centroid is given up where the patch agrees well and lies near it;
/// farther off, what was seen is another part of the symbol.
constexpr float kDoubtfulMisfit = 2.5F, kDoubtfulAcrossPx = 0.25F, kSupportGood = 0.65F;

bool is_worn(const CellGate& gate, const Sightings& seen, std::int32_t node) {
  const CellClaim& claim = seen.claims[node];
  if (claim.island < 0) return false;
  if (claim.status != RegionStatus::kDecoded)
    return claim.status == RegionStatus::kDamagedShape || claim.status == RegionStatus::kOffEpipolarLine;
  return seen.misfits[node] > kDoubtfulMisfit || gate.off_line_px(node, claim.row, claim.column) > kDoubtfulAcrossPx;
}

/// Whether one of the two to each side of it is torn, across the way to what holds it.
bool is_beside_torn(const Sightings& seen, std::int32_t node) {
  constexpr int kFar = 2;
  return std::ranges::any_of(kDirections, [&](Direction held_from) {
    if (decoded_beside(seen.nodes, seen.claims, node, held_from) < 0) return false;
    for (const int side : {0, 1}) {
      const Direction along = across(held_from, side);
      std::int32_t other = seen.nodes[node].links[along];
      for (int i = 0; i < kFar && other >= 0; ++i, other = seen.nodes[other].links[along])
        if (seen.shapes[other].is_torn()) return true;
    }
    return false;
  });
}

/// Whether one is enough to hold it: it fits the grid tightly, or it is worn and has one of the others where its cell
/// is beside. What its surroundings have refused may be of another surface, whole, or torn between both: not where it
/// is torn, or what lies beside it along the edge that would be there.
bool stands_with_one(const Sightings& seen, std::int32_t node, std::span<const std::int32_t> others) {
  const CellClaim& claim = seen.claims[node];
  if (claim.status == RegionStatus::kDecoded) return false;
  const bool tight = claim.grid_fit == GridFit::kTight;
  if (claim.status == RegionStatus::kNeighboursDisagree)
    return tight && !seen.shapes[node].is_torn() && !is_beside_torn(seen, node);
  if (tight) return true;
  return std::ranges::any_of(kDirections, [&](Direction d) {
    const std::int32_t other = neighbour(seen.nodes, node, d);
    return other >= 0 && claim.fits(seen.claims[other], d) && std::ranges::binary_search(others, other);
  });
}

/// Between those on both sides of it, or one step on from two in a line; the mean.
LetterPlace place_by_neighbours(const Sightings& seen, std::int32_t node) {
  const auto holder = [&](std::int32_t of, Direction d) { return decoded_beside(seen.nodes, seen.claims, of, d); };
  LetterPlace place;
  float count = 0;
  for (const Direction d : kDirections) {
    const std::int32_t beside = holder(node, d);
    if (beside < 0) continue;
    ++place.held_by;
    const GreyMoments& light = seen.moments[beside];
    place.frame += seen.nodes[beside].frame, place.background += light.background, place.peak += light.peak;
    const Eigen::Vector2f& centre = seen.nodes[beside].centre_px;
    const std::int32_t behind = holder(node, opposite(d)), next = holder(beside, d);
    if (behind >= 0) {
      place.centre_px += 0.5F * (centre + seen.nodes[behind].centre_px), ++count;
    } else if (next >= 0) {
      place.centre_px += 2 * centre - seen.nodes[next].centre_px, ++count;
    }
  }
  if (count == 0) return {};
  const auto held_by = static_cast<float>(place.held_by);
  return {place.centre_px / count, place.frame / held_by, place.background / held_by, place.peak / held_by,
          place.held_by};
}

/// Where another surface hides the centre, the camera does not see the point. At a corner of what is decoded a surface
/// is likelier to end: the more of the middle has to be seen the less of the patch is. Elsewhere what print darkens
/// does not count.
bool shows_centre(const AskedLetter& asked, const LightShares& middle) {
  constexpr float kMiddleMin = 0.67F, kBothAtCornersMin = 1.45F;
  if (asked.place.held_by > kHeldBy) return middle.agree_beside_print() >= kMiddleMin;
  return middle.agree >= kMiddleMin && asked.task.support + middle.agree >= kBothAtCornersMin;
}

}  // namespace

SymbolMender::SymbolMender(const Pattern& pattern, const std::shared_ptr<const LetterFields>& letters, Rules rules)
    : pitch_px_(static_cast<float>(pattern.pitch_px())),
      rules_(rules),
      aligner_(pattern, letters),
      groups_(pattern, letters, rules),
      disputes_(pattern) {}

DecodeRule SymbolMender::rule_of(Held held) {
  return held == Held::kByOne   ? DecodeRule::kMendedByOne
         : held == Held::kByTwo ? DecodeRule::kMendedByTwo
                                : DecodeRule::kMendedAtCorner;
}

/// What is worn, and what its surroundings have refused, where as far as it could have come with them nothing disputes
/// it.
bool SymbolMender::is_asked(const LetterScene& scene, std::int32_t node) {
  constexpr int kReach = 3;
  CellClaim& claim = scene.seen.claims[node];
  if (claim.status == RegionStatus::kNeighboursDisagree)
    return claim.named() &&
           claim.pass(rules_, DecodeRule::kMendDisputed, disputes_.none_around(scene.seen, node, kReach));
  return is_worn(scene.gate, scene.seen, node);
}

void SymbolMender::ask_all(const LetterScene& scene) {
  to_ask_.clear();
  for (std::size_t i = 0; i < scene.seen.size(); ++i)
    if (const auto node = static_cast<std::int32_t>(i); is_asked(scene, node)) to_ask_.push_back(node);
}

/// Those beside what was mended, from one on. What one alone holds is not certain enough to hold what was refused and
/// does not fit the grid tightly: so another surface would come in from symbol to symbol.
void SymbolMender::ask_beside(const LetterScene& scene, std::size_t first, Held held) {
  const auto may_come = [&](const CellClaim& claim) {
    if (claim.status == RegionStatus::kDecoded) return false;
    return held == Held::kByTwo || claim.status != RegionStatus::kNeighboursDisagree ||
           claim.grid_fit == GridFit::kTight;
  };
  to_ask_.clear();
  for (std::size_t i = first; i < mended_.size(); ++i) {
    for (const std::int32_t other : scene.seen.nodes[mended_[i]].links)
      if (other >= 0 && may_come(scene.seen.claims[other]) && is_asked(scene, other)) to_ask_.push_back(other);
  }
  sort_asked();
}

/// Each once.
void SymbolMender::sort_asked() {
  std::ranges::sort(to_ask_);
  to_ask_.erase(std::unique(to_ask_.begin(), to_ask_.end()), to_ask_.end());
}

/// Whether enough hold it, or one that may be enough.
bool SymbolMender::may_be_held(Sightings& seen, const LetterPlace& place, Held held, std::int32_t node) const {
  switch (held) {
    case Held::kByOne:
      return place.held_by == 1 &&
             seen.claims[node].pass(rules_, DecodeRule::kMendAlone, stands_with_one(seen, node, to_ask_));
    case Held::kByTwo:
      return place.held_by >= kHeldBy;
    case Held::kAtCorner:
      break;
  }
  return place.held_by == kHeldBy;
}

/// Whether it settled near where it was looked for, and on its line.
bool SymbolMender::lies_there(Sightings& seen, const AskedLetter& asked) const {
  const PatchTask& task = asked.task;
  CellClaim& claim = seen.claims[asked.node];
  const RegionStatus status = claim.status;
  const bool lone = asked.place.held_by < kHeldBy, refused = status == RegionStatus::kNeighboursDisagree;
  if (!has_settled(rules_, claim, task)) return false;
  const float across_max_px = lone ? kLoneAcrossMaxPx : kAlignedAcrossMaxPx;
  if (!claim.pass(rules_, DecodeRule::kMendOffLine, std::abs(task.state.across) <= across_max_px)) return false;
  const auto lies_near = [&] {
    if (std::abs(task.state.disparity) > kMovedMax * pitch_px_) return false;
    // What is tilted out of all proportion lies anywhere.
    if (!((asked.centre_px - task.map.middle_px).norm() < 0.5F * pitch_px_)) return false;
    if (lone || refused) return std::abs(task.state.disparity) <= kTightSlip * pitch_px_;
    if (status != RegionStatus::kDecoded) return true;
    const GridNode& node = seen.nodes[asked.node];
    return (node.frame.inverse() * (asked.centre_px - node.centre_px)).norm() < kMovedMax * pitch_px_;
  };
  return claim.pass(rules_, DecodeRule::kMendMoved, lies_near());
}

/// @param held  by how many at least; by one, and at a corner, by no more
void SymbolMender::mend_asked(const LetterScene& scene, Held held) {
  Sightings& seen = scene.seen;
  const DecodeRule rule = rule_of(held);
  if (!rules_.has(rule)) return;
  const bool lone = held == Held::kByOne;
  const float tilt_max_px = lone ? kLoneTiltMaxPx : held == Held::kByTwo ? kAlignedTiltMaxPx : kTiltAtCornersMaxPx;
  aligner_.clear();
  for (const std::int32_t node : to_ask_)
    if (const LetterPlace place = place_by_neighbours(seen, node); may_be_held(seen, place, held, node))
      aligner_.ask(scene, node, place);
  aligner_.align(scene);
  agreeing_.clear(), lone_.clear();
  std::vector<AskedLetter>& all = aligner_.asked();
  for (std::size_t i = 0; i < all.size(); ++i) {
    AskedLetter& asked = all[i];
    CellClaim& claim = seen.claims[asked.node];
    if (!lies_there(seen, asked)) continue;
    if (!claim.pass(rules_, DecodeRule::kMendTilted, !(asked.tilt_px > tilt_max_px))) {
      const bool at_corner = asked.place.held_by == kHeldBy && claim.status != RegionStatus::kNeighboursDisagree;
      if (at_corner && held == Held::kByTwo) turned_.push_back(asked.node);
      continue;
    }
    float& support = asked.task.support;
    const LightShares middle = aligner_.shares_of_middle(scene, asked);
    const bool shown = shows_centre(asked, middle);
    if (shown && (lone || (asked.place.held_by > kHeldBy && support < kSupportGood)))
      support = aligner_.support_beside_print(scene, asked);
    const float of_two = claim.status == RegionStatus::kDecoded ? kSupportGood : kWholeSupportMin;
    if (claim.pass(rules_, DecodeRule::kMendHidden, shown) &&
        claim.pass(rules_, DecodeRule::kMendUnlike, support >= (lone ? kLoneSupportMin : of_two))) {
      agreeing_.push_back(i);
      if (lone) lone_.push_back(asked.node);
    } else if (rules_.apply(DecodeRule::kHidden,
                            claim.status == RegionStatus::kDamagedShape && middle.brighter > kHidden)) {
      claim.decide(DecodeRule::kHidden);
      seen.misfits[asked.node] = std::numeric_limits<float>::infinity();
    }
  }
  for (const std::size_t i : agreeing_) {
    CellClaim& claim = seen.claims[all[i].node];
    if (lone && !claim.pass(rules_, DecodeRule::kMendAlone, stands_with_one(seen, all[i].node, lone_))) continue;
    aligner_.take_over(scene, all[i], rule);
    mended_.push_back(all[i].node);
  }
}

const std::vector<std::int32_t>& SymbolMender::mend(const LetterScene& scene) {
  mended_.clear(), turned_.clear();
  groups_.start(scene.seen);
  ask_all(scene);
  std::size_t since = 0;
  for (bool first = true;; first = false) {
    // What is mended holds those beside it.
    while (!to_ask_.empty()) {
      const std::size_t before = mended_.size();
      mend_asked(scene, Held::kByTwo);
      ask_beside(scene, before, Held::kByTwo);
    }
    if (first) {
      ask_all(scene);
    } else {
      ask_beside(scene, since, Held::kByTwo);
    }
    since = mended_.size();
    mend_asked(scene, Held::kByOne);
    const bool by_one = mended_.size() > since;
    if (!by_one) {
      const std::vector<std::int32_t>& grouped = groups_.mend(scene);
      mended_.insert(mended_.end(), grouped.begin(), grouped.end());
    }
    if (mended_.size() == since) break;
    ask_beside(scene, since, by_one ? Held::kByOne : Held::kByTwo);
  }
  // Last, so that nothing is mended by them: they may be of another surface.
  std::ranges::sort(mended_);
  to_ask_.clear();
  for (const std::int32_t node : turned_)
    if (!std::ranges::binary_search(mended_, node)) to_ask_.push_back(node);
  sort_asked();
  mend_asked(scene, Held::kAtCorner);
  std::ranges::sort(mended_);
  return mended_;
}

}  // namespace slsd
