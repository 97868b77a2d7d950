// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/recover_symbols.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "core/decode/centres/align_symbols.hpp"
#include "core/decode/centres/letter_place.hpp"
#include "core/decode/grid/neighbourhood.hpp"

namespace slsd {
namespace {

/// Largest distances from the predicted and from the measured place, as a share of the pitch.
constexpr float kMovedMax = 0.08F;
/// Largest tilt relative to the neighbours if few of them hold the symbol: towards a limb the surface turns away.
/// Between neighbours on opposite sides it cannot.
constexpr float kTiltBesideFewMaxPx = 1;
/// Tilt that noise may cause, in standard deviations of the disparity. The slope's deviation is sqrt(3) times as much
/// at the sides.
constexpr float kTiltSigmas = 5;
/// Limits of a symbol that a single neighbour holds.
constexpr float kLoneTiltMaxPx = 0.25F, kLoneMovedMax = 0.008F;
/// Distance from its letter, standard deviations, or from its line, projector px, beyond which a decoded symbol is
/// aligned too. Its patch must then agree well.
constexpr float kDoubtfulDistance = 2.5F, kDoubtfulAcrossPx = 0.25F, kSupportGood = 0.65F;

/// Largest ratio of a printed symbol's light to its neighbours' light: print absorbs light.
constexpr float kPrintedLightMax = 1.2F;

constexpr std::size_t kAskedAtOnce = 16;  // letters that a worker takes together

bool is_degraded(const CellGate& gate, const Sightings& seen, std::int32_t node) {
  const CellClaim& claim = seen.claims[node];
  if (!claim.named() || is_aligned(seen.aligned[node])) return false;
  if (claim.status != RegionStatus::kDecoded) return claim.status == RegionStatus::kDamagedShape;
  return seen.misfits[node] > kDoubtfulDistance || gate.off_line_px(node, claim.row, claim.column) > kDoubtfulAcrossPx;
}

/// Restores the links of a symbol that lies at the place its supporters predict.
void restore_links(Sightings& seen, std::int32_t node) {
  for (const Direction d : kDirections)
    if (const std::int32_t other = supporter_of(seen, node, d); other >= 0)
      seen.nodes[node].broken[d] = seen.nodes[other].broken[opposite(d)] = false;
}

/// Tells whether the camera sees the symbol's centre. Another surface may hide it, and few supporters make that
/// likelier: the less of the patch agrees, the more of its middle has to agree. With more supporters, pixels that print
/// darkens do not count.
bool shows_centre(const AskedLetter& asked, const LightShares& middle) {
  constexpr float kMiddleMin = 0.67F, kBothBesideFewMin = 1.45F;
  if (asked.place.supported_by > kFewSupporters) return middle.agree_beside_print() >= kMiddleMin;
  return middle.agree >= kMiddleMin && asked.task.support + middle.agree >= kBothBesideFewMin;
}

}  // namespace

SymbolRecovery::SymbolRecovery(const IndexedPattern& indexed, const std::shared_ptr<const LetterFields>& letters,
                               Rules rules)
    : pitch_px_(static_cast<float>(indexed.pattern().pitch_px())), rules_(rules), aligner_(indexed, letters) {}

void SymbolRecovery::ask_all(const LetterScene& scene) {
  to_ask_.clear();
  for (std::size_t i = 0; i < scene.seen.size(); ++i)
    if (const auto node = static_cast<std::int32_t>(i); is_degraded(scene.gate, scene.seen, node))
      to_ask_.push_back(node);
}

/// Queues the neighbours of the recovered symbols, from the given one on.
void SymbolRecovery::ask_beside(const LetterScene& scene, std::size_t first) {
  to_ask_.clear();
  for (std::size_t i = first; i < recovered_.size(); ++i) {
    for (const std::int32_t other : scene.seen.nodes[recovered_[i]].links)
      if (other >= 0 && is_degraded(scene.gate, scene.seen, other)) to_ask_.push_back(other);
  }
  std::ranges::sort(to_ask_);
  to_ask_.erase(std::unique(to_ask_.begin(), to_ask_.end()), to_ask_.end());
}

/// Tells whether the letter settled near its predicted place, and on its line.
bool SymbolRecovery::lies_there(Sightings& seen, const AskedLetter& asked) const {
  const PatchTask& task = asked.task;
  CellClaim& claim = seen.claims[asked.node];
  const bool lone = asked.place.supported_by < kFewSupporters;
  const bool settled = !task.failed && std::abs(task.moved) <= kAlignedSettledPx;
  if (!claim.pass(rules_, DecodeRule::kRecoverUnsettled, settled) || task.failed) return false;
  const float across_max_px = lone ? kLoneAcrossMaxPx : kAlignedAcrossMaxPx;
  if (!claim.pass(rules_, DecodeRule::kRecoverOffLine, std::abs(task.state.across) <= across_max_px)) return false;
  const auto lies_near = [&] {
    if (std::abs(task.state.disparity) > (lone ? kLoneMovedMax : kMovedMax) * pitch_px_) return false;
    // An extreme tilt can put the letter anywhere.
    if (!((asked.centre_px - task.map.middle_px).norm() < 0.5F * pitch_px_)) return false;
    if (claim.status != RegionStatus::kDecoded) return true;
    const GridNode& node = seen.nodes[asked.node];
    return (node.frame.inverse() * (asked.centre_px - node.centre_px)).norm() < kMovedMax * pitch_px_;
  };
  if (!claim.pass(rules_, DecodeRule::kRecoverMoved, lies_near())) return false;
  const float noise_px = kTiltSigmas * task.noise * std::sqrt(task.variance);
  const float beside_more_px =
      asked.place.supported_by > kFewSupporters ? std::hypot(kAlignedTiltMaxPx, noise_px) : kTiltBesideFewMaxPx;
  return claim.pass(rules_, DecodeRule::kRecoverTilted, asked.tilt_px <= (lone ? kLoneTiltMaxPx : beside_more_px));
}

bool SymbolRecovery::shows_letter(const LetterScene& scene, const AskedLetter& asked) const {
  CellClaim& claim = scene.seen.claims[asked.node];
  const bool lone = asked.place.supported_by < kFewSupporters;
  const bool shows = shows_centre(asked, aligner_.shares_of_middle(scene, asked));
  if (!claim.pass(rules_, DecodeRule::kRecoverHidden, shows)) return false;
  float support = asked.task.support;
  if (lone || (asked.place.supported_by > kFewSupporters && support < kSupportGood))
    support = aligner_.support_beside_print(scene, asked);
  const float of_more = claim.status == RegionStatus::kDecoded ? kSupportGood : kWholeSupportMin;
  return claim.pass(rules_, DecodeRule::kRecoverUnlike, support >= (lone ? kLoneSupportMin : of_more));
}

void SymbolRecovery::find_printed(const LetterScene& scene, Executor& executor) const {
  const std::vector<AskedLetter>& all = aligner_.asked();
  executor.run_ranges(
      all.size(),
      [&](std::size_t first, std::size_t last, int) {
        for (std::size_t i = first; i < last; ++i) {
          const AskedLetter& asked = all[i];
          if (scene.seen.shapes[asked.node].is_well_seen()) continue;
          const GreyMoments& light = scene.seen.moments[asked.node];
          const bool brighter =
              light.peak - light.background > kPrintedLightMax * (asked.place.peak - asked.place.background);
          if (!brighter && !aligner_.shows_other_light(scene, asked))
            scene.seen.aligned[asked.node] = Aligned::kPrinted;
        }
      },
      kAskedAtOnce);
}

void SymbolRecovery::recover_asked(const LetterScene& scene, Executor& executor) {
  aligner_.clear();
  for (const std::int32_t node : to_ask_)
    if (const LetterPlace place = place_by_neighbours(scene.seen, node); place.supported_by > 0)
      aligner_.ask(scene, node, place);
  find_printed(scene, executor);
  aligner_.align(scene, executor);
  // Check all before any is recovered, so that their order has no effect.
  const std::vector<AskedLetter>& all = aligner_.asked();
  shown_.resize(all.size());
  executor.run_ranges(
      all.size(),
      [&](std::size_t first, std::size_t last, int) {
        for (std::size_t i = first; i < last; ++i)
          shown_[i] = lies_there(scene.seen, all[i]) && shows_letter(scene, all[i]) ? 1 : 0;
      },
      kAskedAtOnce);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (shown_[i] == 0) continue;
    const AskedLetter& asked = all[i];
    aligner_.take_over(scene, asked);
    restore_links(scene.seen, asked.node);
    recovered_.push_back(asked.node);
  }
}

const std::vector<std::int32_t>& SymbolRecovery::recover(const LetterScene& scene, Executor& executor) {
  recovered_.clear();
  ask_all(scene);
  while (!to_ask_.empty()) {
    const std::size_t before = recovered_.size();
    recover_asked(scene, executor);
    ask_beside(scene, before);
  }
  std::ranges::sort(recovered_);
  return recovered_;
}

}  // namespace slsd
