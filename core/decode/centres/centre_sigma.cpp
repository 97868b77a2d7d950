// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/centre_sigma.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "core/decode/symbols/weigh_patch.hpp"

namespace slsd {
namespace {

constexpr float kLeastPx = 0.01F;  // what is left of sampling and blur
constexpr float kOfAcross = 0.4F, kOfRoughness = 1;
constexpr float kOfMisfitSquared = 0.018F;  // px
/// What lies across on the smoothest of surfaces, besides noise.
constexpr float kSmoothAcrossPx = 0.022F;
constexpr float kUnknownBendPx = 0.02F;
/// Beyond this a neighbour's residual is a fault of its own.
constexpr float kAcrossAroundMaxPx = 0.3F;

bool has_bend(const LatticeSymbol& symbol) {
  const auto& beside = symbol.neighbours;
  return (beside[kRight] >= 0 && beside[kLeft] >= 0) || (beside[kUp] >= 0 && beside[kDown] >= 0);
}

}  // namespace

float noise_of_centre_px(float weight, float background, float gain, const FrameNoise& noise) {
  constexpr float kRamp = kCentreRampEnd - kCentreRampStart;
  const float relative = noise.at(background + 0.5F * gain) / (kRamp * gain);
  return relative / std::sqrt(std::sqrt(weight));
}

void CentreJudge::judge(const FrameNoise& noise, const EpipolarView* view, const CellRays& cells, Executor& executor,
                        Lattice& lattice) {
  std::vector<LatticeSymbol>& symbols = lattice.symbols;
  across_px_.assign(symbols.size(), 0);
  if (view != nullptr && !symbols.empty()) {
    executor.run_ranges(symbols.size(), [&](std::size_t first, std::size_t last, int) {
      for (std::size_t i = first; i < last; ++i) {
        const LatticeSymbol& symbol = symbols[i];
        across_px_[i] = static_cast<float>(
            view->residual_px(symbol.sighting, symbol.centre_px, cells.ray(symbol.row, symbol.column)));
      }
    });
    sorted_ = across_px_;
    const auto middle = sorted_.begin() + static_cast<std::ptrdiff_t>(sorted_.size() / 2);
    std::nth_element(sorted_.begin(), middle, sorted_.end());
    const float usual_px = *middle;
    for (std::size_t i = 0; i < symbols.size(); ++i)
      across_px_[i] = std::abs(across_px_[i] - usual_px) * std::sqrt(std::abs(symbols[i].frame.determinant()));
  }
  const auto square = [](float x) { return x * x; };
  const auto sigma_of = [&](std::size_t i) {
    const LatticeSymbol& symbol = symbols[i];
    float around = square(across_px_[i]), count = 1;
    for (const std::int32_t other : symbol.neighbours) {
      if (other < 0) continue;
      around += square(std::min(across_px_[static_cast<std::size_t>(other)], kAcrossAroundMaxPx));
      ++count;
    }
    const float noise_px = noise_of_centre_px(symbol.weight, symbol.background, symbol.gain, noise);
    const float roughness = std::max(0.F, around / count - square(noise_px) - square(kSmoothAcrossPx));
    return std::sqrt(square(noise_px) + square(kLeastPx) + square(kOfAcross * across_px_[i]) +
                     square(kOfRoughness) * roughness + square(kOfMisfitSquared * square(symbol.misfit)) +
                     (has_bend(symbol) ? 0 : square(kUnknownBendPx)));
  };
  executor.run_ranges(symbols.size(), [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) symbols[i].sigma_px = sigma_of(i);
  });
}

}  // namespace slsd
