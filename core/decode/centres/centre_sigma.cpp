// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/centre_sigma.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include <Eigen/LU>

#include "core/clones.hpp"
#include "core/decode/symbols/weigh_patch.hpp"
#include "core/geometry/robust.hpp"

namespace slsd {
namespace {

constexpr float kOfNoise = 0.55F;
constexpr float kLeastPx = 0.01F;  // remaining error of sampling and blur
constexpr float kOfAcross = 0.4F, kOfUneven = 0.4F;
constexpr float kOfRoughness = 0.25F, kOfUnevenness = 0.25F;
constexpr float kOfMisfitSquared = 0.01F;  // px
/// Residual across the line, and unevenness, on the smoothest surfaces, besides noise.
constexpr float kSmoothAcrossPx = 0.03F, kSmoothUnevenPx = 0.02F;
constexpr float kUnknownBendPx = 0.015F;
/// Factors for shapes that are cut, not only degraded.
constexpr float kDamageOfAcross = 0.35F;
constexpr float kDamageOfMisfitSquared = 0.018F;  // px
/// Largest residual of a neighbour that counts: beyond it the neighbour itself is wrong.
constexpr float kAroundMaxPx = 0.3F;

float square(float x) {
  return x * x;
}

/// Pairs of opposite directions.
constexpr std::array<std::pair<Direction, Direction>, 2> kAcrossEachOther{{{kLeft, kRight}, {kUp, kDown}}};

bool has_bend(const LatticeSymbol& symbol) {
  return std::ranges::any_of(kAcrossEachOther, [&](const auto& pair) {
    return symbol.neighbours[pair.first] >= 0 && symbol.neighbours[pair.second] >= 0;
  });
}

/// Difference between a symbol's disparity and the mean of its neighbours on opposite sides, averaged over the pairs; 0
/// without pairs. A plane's disparity is linear over the image.
float off_neighbours(const std::vector<LatticeSymbol>& symbols, const std::vector<float>& disparities_px,
                     std::size_t i) {
  float sum = 0, count = 0;
  for (const auto& [one, other] : kAcrossEachOther) {
    const std::int32_t a = symbols[i].neighbours[one], b = symbols[i].neighbours[other];
    if (a < 0 || b < 0) continue;
    const auto first = static_cast<std::size_t>(a), second = static_cast<std::size_t>(b);
    const Eigen::Vector2f from = symbols[first].centre_px, way = symbols[second].centre_px - from;
    const float along = way.dot(symbols[i].centre_px - from) / way.squaredNorm();
    sum += disparities_px[i] - disparities_px[first] - along * (disparities_px[second] - disparities_px[first]);
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

/// Difference between a symbol's value and the median of its neighbours', the upper median of an even number; 0 without
/// neighbours.
float off_those_around(const std::vector<float>& values, const std::array<std::int32_t, 4>& neighbours, std::size_t i) {
  // No branches: the processor cannot predict the values. Missing neighbours get -infinity and infinity in turn, and
  // the median of four is the second greatest.
  float missing = -std::numeric_limits<float>::infinity();
  std::array<float, 4> around;
  bool any = false;
  for (std::size_t k = 0; k < around.size(); ++k) {
    const bool there = neighbours[k] >= 0;
    around[k] = there ? values[static_cast<std::size_t>(neighbours[k])] : missing;
    missing = there ? missing : -missing;
    any |= there;
  }
  const auto [a, b, c, d] = around;
  const float middle = std::max(std::min(std::max(a, b), std::max(c, d)), std::max(std::min(a, b), std::min(c, d)));
  return any ? values[i] - middle : 0;
}

/// Properties of many symbols at once, one column for each.
constexpr std::size_t kAtOnce = 64;
struct Columns {
  using Column = std::array<float, kAtOnce>;
  Column weight, background, gain, misfit;
  Column unbent;                                 // px^2
  Column across, uneven;                         // px
  Column across_squares, uneven_squares, count;  // sums over a symbol and up to that many neighbours; number of terms
  Column sigma_px, damage_px;                    // results
};

/// Sums the squares of a symbol's neighbours. A neighbour with a large residual is itself wrong.
/// @param own  the symbol
void sum_around(const std::vector<float>& across_px, const std::vector<float>& uneven_px,
                const std::array<std::int32_t, 4>& neighbours, std::size_t own, std::size_t i, Columns& columns) {
  float across = 0, uneven = 0, count = 1;
  for (const std::int32_t other : neighbours) {
    const std::size_t at = other < 0 ? own : static_cast<std::size_t>(other);
    const float counts = other < 0 ? 0 : 1;
    across += counts * square(std::min(std::abs(across_px[at]), kAroundMaxPx));
    uneven += counts * square(std::min(std::abs(uneven_px[at]), kAroundMaxPx));
    count += counts;
  }
  columns.across_squares[i] = across, columns.uneven_squares[i] = uneven, columns.count[i] = count;
}

inline __attribute__((always_inline)) float noise_of(float weight, float background, float gain,
                                                     const FrameNoise& noise) {
  constexpr float kRamp = kCentreRampEnd - kCentreRampStart;
  const float relative = noise.at(background + 0.5F * gain) / (kRamp * gain);
  return relative / std::sqrt(std::sqrt(weight));
}

inline __attribute__((always_inline)) void judge_all(const FrameNoise& noise, float usual_misfit_squared, Columns& c) {
#pragma omp simd
  for (std::size_t i = 0; i < kAtOnce; ++i) {
    const float noise_squared = square(noise_of(c.weight[i], c.background[i], c.gain[i], noise));
    const float across_squared = square(c.across[i]), uneven_squared = square(c.uneven[i]);
    const float rough = (across_squared + c.across_squares[i]) / c.count[i] - noise_squared - square(kSmoothAcrossPx),
                uneven =
                    (uneven_squared + c.uneven_squares[i]) / c.count[i] - 2 * noise_squared - square(kSmoothUnevenPx);
    const float roughness = rough > 0 ? rough : 0, unevenness = uneven > 0 ? uneven : 0;
    const float misfit_squared = square(c.misfit[i]), beyond = misfit_squared - usual_misfit_squared;
    const float misfit = beyond > 0 ? beyond : 0;
    const float least = square(kLeastPx) + c.unbent[i];
    c.sigma_px[i] = std::sqrt(square(kOfNoise) * noise_squared + least + square(kOfAcross) * across_squared +
                              square(kOfUneven) * uneven_squared + square(kOfRoughness) * roughness +
                              square(kOfUnevenness) * unevenness + std::sqrt(roughness * unevenness) +
                              square(kOfMisfitSquared * misfit));
    c.damage_px[i] = std::sqrt(noise_squared + least + square(kDamageOfAcross) * across_squared + roughness +
                               square(kDamageOfMisfitSquared * misfit_squared));
  }
}

}  // namespace

float noise_of_centre_px(float weight, float background, float gain, const FrameNoise& noise) {
  return noise_of(weight, background, gain, noise);
}

void CentreJudge::measure_across(const EpipolarView& view, const CellRays& cells, Executor& executor,
                                 const std::vector<LatticeSymbol>& symbols) {
  executor.run_ranges(symbols.size(), [&](std::size_t first, std::size_t last, int) {
    const auto of_these = [&](auto& all) { return std::span(all).subspan(first, last - first); };
    view.compare(of_these(symbols), cells, of_these(across_px_), of_these(disparities_px_));
  });
  const float usual_px = usual_of(symbols.size(), [&](std::size_t i) { return across_px_[i]; });
  for (std::size_t i = 0; i < symbols.size(); ++i)
    across_px_[i] = std::abs(across_px_[i] - usual_px) * std::sqrt(std::abs(symbols[i].frame.determinant()));
}

void CentreJudge::measure_unevenness(const std::vector<LatticeSymbol>& symbols, Executor& executor) {
  executor.run_ranges(symbols.size(), [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) {
      beyond_px_[i] = off_neighbours(symbols, disparities_px_, i);
    }
  });
  executor.run_ranges(symbols.size(), [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) uneven_px_[i] = off_those_around(beyond_px_, symbols[i].neighbours, i);
  });
}

void CentreJudge::judge(const FrameNoise& noise, const EpipolarView* view, const CellRays& cells, Executor& executor,
                        Lattice& lattice) {
  std::vector<LatticeSymbol>& symbols = lattice.symbols;
  for (std::vector<float>* each : {&across_px_, &disparities_px_, &beyond_px_, &uneven_px_})
    each->assign(symbols.size(), 0);
  if (view != nullptr) measure_across(*view, cells, executor, symbols), measure_unevenness(symbols, executor);
  const float usual_misfit_squared = usual_of(symbols.size(), [&](std::size_t i) { return square(symbols[i].misfit); });
  executor.run_ranges(
      symbols.size(),
      [&](std::size_t first, std::size_t last, int) {
        Columns columns{};
        columns.count.fill(1);
        for (std::size_t i = first; i < last; ++i) {
          const LatticeSymbol& symbol = symbols[i];
          const std::size_t at = i - first;
          columns.weight[at] = symbol.weight;
          columns.background[at] = symbol.background, columns.gain[at] = symbol.gain;
          columns.misfit[at] = symbol.misfit;
          columns.unbent[at] = has_bend(symbol) ? 0 : square(kUnknownBendPx);
          columns.across[at] = across_px_[i], columns.uneven[at] = uneven_px_[i];
          sum_around(across_px_, uneven_px_, symbol.neighbours, i, at, columns);
        }
        Cloned<judge_all>::call(noise, usual_misfit_squared, columns);
        for (std::size_t i = first; i < last; ++i)
          symbols[i].sigma_px = columns.sigma_px[i - first], symbols[i].damage_px = columns.damage_px[i - first];
      },
      kAtOnce);
}

}  // namespace slsd
