// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/curvature.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <Eigen/LU>

#include "core/decode/grid/neighbourhood.hpp"

namespace slsd {
namespace {

/// Step from a cell's number to that of the cell below. It exceeds the columns of any pattern, so the ends of two rows
/// are never adjacent.
constexpr std::int32_t kRowStep = 1 << 16;

/// Bend over a symbol's size that moves its centre by a tenth of this value: about as much as noise does.
constexpr float kSlightPx = 0.12F;

/// Offset from the image of the point that a symbol's centroid lights to the centroid of its image.
/// @param m  second moments of the symbol, projector px squared
Eigen::Vector2f pull_of(const Bend& bend, const LatticeFrame& frame, const Eigen::Matrix2f& m) {
  const Eigen::Matrix2f inverse = frame.inverse();
  Eigen::Matrix2f along_u, along_v;
  along_u << bend.uu, bend.uv;
  along_v << bend.uv, bend.vv;
  const Eigen::Vector2f log_area_gradient((inverse * along_u).trace(), (inverse * along_v).trace());
  return 0.5F * (bend.uu * m(0, 0) + 2 * bend.uv * m(0, 1) + bend.vv * m(1, 1)) + frame * (m * log_area_gradient);
}

}  // namespace

CentreCorrection::CentreCorrection(const std::vector<Prototype>& prototypes, float pitch_px, float symbol_size_px)
    : prototypes_(prototypes),
      size_px_(symbol_size_px),
      pitch_px_(pitch_px),
      slight_bend_(kSlightPx / (symbol_size_px * symbol_size_px)) {
  for (const Prototype& prototype : prototypes) {
    const ShapeFeatures& mean = prototype.mean;
    Eigen::Matrix2f moments;
    moments << mean[1], mean[2], mean[2], mean[3];
    centroids_px_.push_back(prototype.centroid_px);
    second_moments_px2_.push_back(moments * symbol_size_px * symbol_size_px);
  }
}

/// Finds the decoded neighbours whose cells agree with the symbol's.
CentreCorrection::Neighbours CentreCorrection::find_neighbours(const std::vector<GridNode>& nodes,
                                                               std::int32_t node) const {
  constexpr std::array<std::int32_t, 4> kBeyond{1, kRowStep, -1, -kRowStep};  // by Direction
  Neighbours found{-1, -1, -1, -1};
  for (const Direction d : kDirections) {
    const std::int32_t other = neighbour(nodes, node, d);
    if (other >= 0 && cells_[other] == cells_[node] + kBeyond[d]) found[d] = symbol_of_[other];
  }
  return found;
}

void CentreCorrection::measure_bends(std::int32_t symbol) {
  const auto next = [&](std::int32_t from, Direction d) { return from < 0 ? -1 : neighbours_[from][d]; };
  const float per_squared_px = 1 / (pitch_px_ * pitch_px_);
  const auto [right, down, left, up] = neighbours_[symbol];
  const Eigen::Vector2f twice_here = 2 * centres_[symbol];
  Derivatives& at = derivatives_[symbol] = {};
  if (right >= 0 && left >= 0) {
    at.bend.uu = (centres_[right] + centres_[left] - twice_here) * per_squared_px;
    at.has_uu = true;
  }
  if (up >= 0 && down >= 0) {
    at.bend.vv = (centres_[up] + centres_[down] - twice_here) * per_squared_px;
    at.has_vv = true;
  }
  const std::int32_t up_left = next(up, kLeft), up_right = next(up, kRight), down_left = next(down, kLeft),
                     down_right = next(down, kRight);
  if (up_left >= 0 && up_right >= 0 && down_left >= 0 && down_right >= 0) {
    at.bend.uv = (centres_[down_right] + centres_[up_left] - centres_[up_right] - centres_[down_left]) *
                 (0.25F * per_squared_px);
    at.has_uv = true;
  }
  if (!at.has_uu || !at.has_uv || !at.has_vv) return;
  const float largest =
      std::max({at.bend.uu.cwiseAbs().maxCoeff(), at.bend.uv.cwiseAbs().maxCoeff(), at.bend.vv.cwiseAbs().maxCoeff()});
  at.is_slight = largest < slight_bend_;
  if (!at.is_slight) return;
  const auto over_two = [&](std::int32_t last, std::int32_t first, const Eigen::Vector2f& over_one) -> Eigen::Vector2f {
    if (last < 0 || first < 0) return over_one;
    return (centres_[last] + centres_[first] - twice_here) * (0.25F * per_squared_px);
  };
  at.over_two = {over_two(next(right, kRight), next(left, kLeft), at.bend.uu), at.bend.uv,
                 over_two(next(down, kDown), next(up, kUp), at.bend.vv)};
}

template <class Part>
Eigen::Vector2f CentreCorrection::median_around(const std::vector<GridNode>& nodes, std::int32_t symbol,
                                                bool Derivatives::*has, Part part) const {
  std::array<float, 5> x, y;
  int count = 0;
  const auto add = [&](std::int32_t other) {
    if (other < 0 || !(derivatives_[other].*has)) return;
    const Eigen::Vector2f& value = derivatives_[other].bend.*part;
    x[count] = value.x(), y[count] = value.y();
    ++count;
  };
  add(symbol);
  for (const Direction d : kDirections) {
    const std::int32_t other = neighbour(nodes, sightings_[symbol], d);
    if (other >= 0) add(symbol_of_[other]);
  }
  if (count == 0) return {0, 0};
  const auto median = [count](std::array<float, 5>& values) {
    for (int i = 1; i < count; ++i) {
      for (int k = i; k > 0 && values[k] < values[k - 1]; --k) std::swap(values[k], values[k - 1]);
    }
    return 0.5F * (values[(count - 1) / 2] + values[count / 2]);
  };
  return {median(x), median(y)};
}

/// The mean with the neighbours that hardly bend either: it has less noise than the bend alone.
Bend CentreCorrection::slight_bend_around(std::int32_t symbol) const {
  Bend sum = derivatives_[symbol].over_two;
  float count = 1;
  for (const std::int32_t other : neighbours_[symbol]) {
    if (other < 0 || !derivatives_[other].is_slight) continue;
    const Bend& bend = derivatives_[other].over_two;
    sum.uu += bend.uu, sum.uv += bend.uv, sum.vv += bend.vv, ++count;
  }
  return {sum.uu / count, sum.uv / count, sum.vv / count};
}

Bend CentreCorrection::bend_of(const std::vector<GridNode>& nodes, std::int32_t symbol) const {
  if (derivatives_[symbol].is_slight) return slight_bend_around(symbol);
  // The median over the neighbours has less noise, fills in missing values, and ignores neighbours across an edge in
  // depth.
  return {median_around(nodes, symbol, &Derivatives::has_uu, &Bend::uu),
          median_around(nodes, symbol, &Derivatives::has_uv, &Bend::uv),
          median_around(nodes, symbol, &Derivatives::has_vv, &Bend::vv)};
}

void CentreCorrection::correct(const std::vector<GridNode>& nodes, const std::vector<GreyMoments>& moments,
                               const std::vector<CellClaim>& claims, const CodeArray& array, Executor& executor,
                               Lattice& lattice, std::span<const float> misfits) {
  cells_.resize(nodes.size()), symbol_of_.resize(nodes.size());
  sightings_.clear();
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const CellClaim& claim = claims[i];
    cells_[i] = symbol_of_[i] = -1;
    if (claim.status != RegionStatus::kDecoded) continue;
    cells_[i] = claim.row * kRowStep + claim.column;
    symbol_of_[i] = static_cast<std::int32_t>(sightings_.size());
    sightings_.push_back(static_cast<std::int32_t>(i));
  }
  const std::size_t count = sightings_.size();
  centres_.resize(count), neighbours_.resize(count), derivatives_.resize(count), lattice.symbols.resize(count);
  // work(its number, its node, the letter of its cell)
  const auto for_each_symbol = [&](auto&& work) {
    executor.run_ranges(count, [&](std::size_t first, std::size_t last, int) {
      for (auto i = static_cast<std::int32_t>(first); i < static_cast<std::int32_t>(last); ++i) {
        const CellClaim& claim = claims[sightings_[i]];
        work(i, sightings_[i], array.at(claim.row, claim.column));
      }
    });
  };
  for_each_symbol([&](std::int32_t symbol, std::int32_t node, std::size_t letter) {
    centres_[symbol] = Eigen::Vector2f(moments[node].x, moments[node].y) - nodes[node].frame * centroids_px_[letter];
    neighbours_[symbol] = find_neighbours(nodes, node);
  });
  for_each_symbol([&](std::int32_t symbol, std::int32_t, std::size_t) { measure_bends(symbol); });
  for_each_symbol([&](std::int32_t symbol, std::int32_t node, std::size_t letter) {
    const GreyMoments& seen = moments[node];
    const LatticeFrame& frame = nodes[node].frame;
    const float misfit =
        misfits.empty()
            ? std::sqrt(prototypes_[letter].squared_distance(shape_features(seen, frame.inverse(), size_px_)))
            : misfits[node];
    const Bend bend = bend_of(nodes, symbol);
    lattice.symbols[symbol] = {
        .sighting = node,
        .row = claims[node].row,
        .column = claims[node].column,
        .centre_px = Eigen::Vector2f(seen.x, seen.y) - pull_of(bend, frame, second_moments_px2_[letter]),
        .frame = frame,
        .bend = bend,
        .background = seen.background,
        .gain = seen.peak - seen.background,
        .misfit = misfit,
        .weight = seen.weight,
        .sigma_px = 0,
        .damage_px = 0,
        .neighbours = neighbours_[symbol]};
  });
}

}  // namespace slsd
