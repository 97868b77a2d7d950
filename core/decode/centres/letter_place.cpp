// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/letter_place.hpp"

#include "core/decode/grid/neighbourhood.hpp"

namespace slsd {

std::int32_t supporter_of(const Sightings& seen, std::int32_t node, Direction d) {
  const std::int32_t other = seen.nodes[node].links[d];
  const bool holds = other >= 0 && seen.claims[other].status == RegionStatus::kDecoded;
  return holds && seen.claims[node].fits(seen.claims[other], d) ? other : -1;
}

LetterPlace place_by_neighbours(const Sightings& seen, std::int32_t node) {
  const auto supporter = [&](std::int32_t of, Direction d) { return supporter_of(seen, of, d); };
  LetterPlace place;
  float count = 0;
  for (const Direction d : kDirections) {
    const std::int32_t beside = supporter(node, d);
    if (beside < 0) continue;
    ++place.supported_by;
    const GreyMoments& light = seen.moments[beside];
    place.frame += seen.nodes[beside].frame, place.background += light.background, place.peak += light.peak;
    const Eigen::Vector2f& centre = seen.nodes[beside].centre_px;
    const std::int32_t behind = supporter(node, opposite(d)), next = decoded_beside(seen.nodes, seen.claims, beside, d);
    if (behind >= 0) {
      place.centre_px += 0.5F * (centre + seen.nodes[behind].centre_px), ++count;
    } else if (next >= 0) {
      place.centre_px += 2 * centre - seen.nodes[next].centre_px, ++count;
    }
  }
  if (count == 0) return {};
  const auto supported_by = static_cast<float>(place.supported_by);
  return {place.centre_px / count, place.frame / supported_by, place.background / supported_by,
          place.peak / supported_by, place.supported_by};
}

}  // namespace slsd
