// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/curvature.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <Eigen/LU>

namespace slsd {
namespace {

/// From a cell's number to that of the one below: more than any pattern has columns, so that none lies beside the end
/// of another row.
constexpr std::int32_t kRowStep = 1 << 16;

/// Bend over a symbol's size that moves its centre by a tenth of that: about as much as noise does.
constexpr float kSlightPx = 0.12F;

/// How far the centroid of a symbol's image lies from the point that its centroid lights.
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

/// Where a node's neighbours are that are decoded, and as such agree with it.
std::array<std::int32_t, 4> CentreCorrection::find_named(const GridNode& node, std::size_t index) const {
  constexpr std::array<std::int32_t, 4> kBeyond{1, kRowStep, -1, -kRowStep};  // by Direction
  std::array<std::int32_t, 4> named{-1, -1, -1, -1};
  if (cells_[index] < 0) return named;
  for (const Direction d : kDirections) {
    const std::int32_t other = node.broken[d] ? -1 : node.links[d];
    if (other >= 0 && cells_[other] == cells_[index] + kBeyond[d]) named[d] = other;
  }
  return named;
}

void CentreCorrection::measure_bends(std::int32_t node) {
  const auto next = [&](std::int32_t from, Direction d) { return from < 0 ? -1 : named_[from][d]; };
  const float per_squared_px = 1 / (pitch_px_ * pitch_px_);
  const auto [right, down, left, up] = named_[node];
  Derivatives& at = derivatives_[node] = {};
  if (right >= 0 && left >= 0) {
    at.bend.uu = (centres_[right] + centres_[left] - 2 * centres_[node]) * per_squared_px;
    at.has_uu = true;
  }
  if (up >= 0 && down >= 0) {
    at.bend.vv = (centres_[up] + centres_[down] - 2 * centres_[node]) * per_squared_px;
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
    return (centres_[last] + centres_[first] - 2 * centres_[node]) * (0.25F * per_squared_px);
  };
  at.over_two = {over_two(next(right, kRight), next(left, kLeft), at.bend.uu), at.bend.uv,
                 over_two(next(down, kDown), next(up, kUp), at.bend.vv)};
}

template <class Part>
Eigen::Vector2f CentreCorrection::median_around(const std::vector<GridNode>& nodes, std::int32_t node,
                                                bool Derivatives::*has, Part part) const {
  std::array<float, 5> x, y;
  int count = 0;
  const auto add = [&](std::int32_t other) {
    if (other < 0 || !(derivatives_[other].*has)) return;
    const Eigen::Vector2f& value = derivatives_[other].bend.*part;
    x[count] = value.x(), y[count] = value.y();
    ++count;
  };
  add(node);
  for (const Direction d : kDirections) add(neighbour(nodes, node, d));
  if (count == 0) return {0, 0};
  const auto median = [count](std::array<float, 5>& values) {
    for (int i = 1; i < count; ++i) {
      for (int k = i; k > 0 && values[k] < values[k - 1]; --k) std::swap(values[k], values[k - 1]);
    }
    return 0.5F * (values[(count - 1) / 2] + values[count / 2]);
  };
  return {median(x), median(y)};
}

/// The mean with the neighbours that hardly bend either: less noise than the bend itself.
Bend CentreCorrection::slight_bend_around(std::int32_t node) const {
  Bend sum = derivatives_[node].over_two;
  float count = 1;
  for (const std::int32_t other : named_[node]) {
    if (other < 0 || !derivatives_[other].is_slight) continue;
    const Bend& bend = derivatives_[other].over_two;
    sum.uu += bend.uu, sum.uv += bend.uv, sum.vv += bend.vv, ++count;
  }
  return {sum.uu / count, sum.uv / count, sum.vv / count};
}

Bend CentreCorrection::bend_of(const std::vector<GridNode>& nodes, std::int32_t node) const {
  if (derivatives_[node].is_slight) return slight_bend_around(node);
  // The median with the neighbours: less noise, a value where none could be measured, and none from across an edge in
  // depth.
  return {median_around(nodes, node, &Derivatives::has_uu, &Bend::uu),
          median_around(nodes, node, &Derivatives::has_uv, &Bend::uv),
          median_around(nodes, node, &Derivatives::has_vv, &Bend::vv)};
}

/// @param letter  of its cell
LatticeSymbol CentreCorrection::symbol_of(const std::vector<GridNode>& nodes, const GreyMoments& seen,
                                          const CellClaim& claim, std::int32_t node, std::size_t letter,
                                          std::optional<float> misfit) const {
  LatticeSymbol symbol{.sighting = node,
                       .row = claim.row,
                       .column = claim.column,
                       .centre_px = {seen.x, seen.y},
                       .frame = nodes[node].frame,
                       .bend = {},
                       .background = seen.background,
                       .gain = seen.peak - seen.background,
                       .misfit = 0,
                       .weight = seen.weight,
                       .sigma_px = 0,
                       .damage_px = 0,
                       .neighbours = {-1, -1, -1, -1}};
  symbol.misfit =
      misfit ? *misfit
             : std::sqrt(prototypes_[letter].squared_distance(shape_features(seen, symbol.frame.inverse(), size_px_)));
  for (const Direction d : kDirections) {
    if (named_[node][d] >= 0) symbol.neighbours[d] = symbol_of_[named_[node][d]];
  }
  symbol.bend = bend_of(nodes, node);
  symbol.centre_px -= pull_of(symbol.bend, symbol.frame, second_moments_px2_[letter]);
  return symbol;
}

void CentreCorrection::correct(const std::vector<GridNode>& nodes, const std::vector<GreyMoments>& moments,
                               const std::vector<CellClaim>& claims, const CodeArray& array, Executor& executor,
                               Lattice& lattice, std::span<const float> misfits) {
  centres_.resize(nodes.size());
  named_.resize(nodes.size());
  derivatives_.resize(nodes.size());
  symbol_of_.resize(nodes.size());
  cells_.resize(nodes.size());
  std::int32_t symbols = 0;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const bool decoded = claims[i].status == RegionStatus::kDecoded;
    symbol_of_[i] = decoded ? symbols++ : -1;
    cells_[i] = decoded ? claims[i].row * kRowStep + claims[i].column : -1;
  }
  const auto for_each_node = [&](auto&& work) {
    executor.run_ranges(nodes.size(), [&](std::size_t first, std::size_t last, int) {
      for (std::size_t i = first; i < last; ++i) work(i);
    });
  };
  for_each_node([&](std::size_t i) {
    centres_[i] = {moments[i].x, moments[i].y};
    if (claims[i].named()) centres_[i] -= nodes[i].frame * centroids_px_[array.at(claims[i].row, claims[i].column)];
    named_[i] = find_named(nodes[i], i);
  });
  for_each_node([&](std::size_t i) { measure_bends(static_cast<std::int32_t>(i)); });
  lattice.symbols.resize(static_cast<std::size_t>(symbols));
  for_each_node([&](std::size_t i) {
    if (symbol_of_[i] < 0) return;
    const auto misfit = misfits.empty() ? std::nullopt : std::optional<float>(misfits[i]);
    lattice.symbols[static_cast<std::size_t>(symbol_of_[i])] = symbol_of(
        nodes, moments[i], claims[i], static_cast<std::int32_t>(i), array.at(claims[i].row, claims[i].column), misfit);
  });
}

}  // namespace slsd
