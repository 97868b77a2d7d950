// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/letter_place.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "core/decode/grid/neighbourhood.hpp"

namespace slsd {
namespace {

/// @param around  becomes the node and those up to a few links away whose cells lie beside each other as the nodes do
void find_around(const Sightings& seen, std::int32_t node, std::vector<std::int32_t>& around) {
  constexpr std::size_t kAroundMax = 24;
  around.assign(1, node);
  for (std::size_t next = 0; next < around.size() && around.size() < kAroundMax; ++next) {
    for (const Direction d : kDirections) {
      const std::int32_t other = seen.nodes[around[next]].links[d];
      if (other < 0 || !seen.claims[around[next]].fits(seen.claims[other], d)) continue;
      if (std::ranges::find(around, other) == around.end()) around.push_back(other);
    }
  }
}

/// Maps projector px from a symbol's centre to camera px, fitted by least squares.
struct PlaneFit {
  Eigen::Matrix<float, 3, 2> map;  ///< maps (1, right, down), projector px, to camera px
  float rms_px = 0;                ///< distance of the nodes from it, camera px
};

Eigen::Vector3f offset_of(const CellClaim& from, const CellClaim& claim, float pitch_px) {
  return {1, pitch_px * static_cast<float>(claim.column - from.column),
          pitch_px * static_cast<float>(claim.row - from.row)};
}

PlaneFit fit_plane(const Sightings& seen, const CellClaim& from, float pitch_px, std::span<const std::int32_t> nodes) {
  Eigen::Matrix3f squares = Eigen::Matrix3f::Zero();
  Eigen::Matrix<float, 3, 2> sums = Eigen::Matrix<float, 3, 2>::Zero();
  for (const std::int32_t node : nodes) {
    const Eigen::Vector3f offset = offset_of(from, seen.claims[node], pitch_px);
    squares += offset * offset.transpose(), sums += offset * seen.nodes[node].centre_px.transpose();
  }
  PlaneFit fit{Eigen::LDLT<Eigen::Matrix3f>(squares).solve(sums)};
  float residuals = 0;
  for (const std::int32_t node : nodes) {
    const Eigen::Vector3f offset = offset_of(from, seen.claims[node], pitch_px);
    residuals += (fit.map.transpose() * offset - seen.nodes[node].centre_px).squaredNorm();
  }
  fit.rms_px = std::sqrt(residuals / static_cast<float>(nodes.size()));
  return fit;
}

}  // namespace

std::int32_t holder_of(const Sightings& seen, std::int32_t node, Direction d) {
  const std::int32_t other = seen.nodes[node].links[d];
  const bool holds = other >= 0 && seen.claims[other].status == RegionStatus::kDecoded;
  return holds && seen.claims[node].fits(seen.claims[other], d) ? other : -1;
}

LetterPlace place_by_neighbours(const Sightings& seen, std::int32_t node) {
  const auto holder = [&](std::int32_t of, Direction d) { return holder_of(seen, of, d); };
  LetterPlace place;
  float count = 0;
  for (const Direction d : kDirections) {
    const std::int32_t beside = holder(node, d);
    if (beside < 0) continue;
    ++place.held_by;
    const GreyMoments& light = seen.moments[beside];
    place.frame += seen.nodes[beside].frame, place.background += light.background, place.peak += light.peak;
    const Eigen::Vector2f& centre = seen.nodes[beside].centre_px;
    const std::int32_t behind = holder(node, opposite(d)), next = decoded_beside(seen.nodes, seen.claims, beside, d);
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

LetterPlace place_by_plane(const Sightings& seen, std::int32_t node, float pitch_px,
                           std::vector<std::int32_t>& around) {
  constexpr std::size_t kAroundMin = 8;
  constexpr float kRmsMax = 0.08F;  // share of the pitch: the limb of a curved surface deviates more
  find_around(seen, node, around);
  if (around.size() < kAroundMin) return {};
  const PlaneFit fit = fit_plane(seen, seen.claims[node], pitch_px, around);
  LetterPlace place{.centre_px = fit.map.row(0), .frame = fit.map.bottomRows<2>().transpose()};
  if (!(fit.rms_px < kRmsMax * pitch_px * std::sqrt(std::abs(place.frame.determinant())))) return {};
  for (const std::int32_t other : around)
    place.background += seen.moments[other].background, place.peak += seen.moments[other].peak;
  const auto count = static_cast<float>(around.size());
  place.background /= count, place.peak /= count;
  place.held_by = kFewHolders + 1;  // counts as held on all its sides
  return place;
}

}  // namespace slsd
