// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbols/appearance.hpp"

#include <algorithm>
#include <iterator>
#include <tuple>
#include <utility>

#include "core/geometry/robust.hpp"
#include "core/lanes.hpp"

namespace slsd {
namespace {

/// Errors of local frames: an expected frame ignores the tilt of the surface; a measured one has noise and curvature.
constexpr float kExpectedFrameError = 0.15F;
constexpr float kMeasuredFrameError = 0.05F;
/// Distance from the nearest prototype, in standard deviations, beyond which a shape is none of the pattern's symbols.
constexpr float kExpectedDistanceMax = 25;
constexpr float kMeasuredDistanceMax = 20;
constexpr std::optional<float> kAnyBlur[] = {std::nullopt};

/// Larger symbols look like those of this side, in camera px. Drawing them takes time in squares of the side, and a
/// calibration in micrometres predicts thousands of px.
constexpr float kDrawnSidePxMax = 96;

float drawn_scale(const PatternOptions& pattern, float camera_px_per_projector_px) {
  const float most = kDrawnSidePxMax / static_cast<float>(pattern.symbol_size_px);
  return camera_px_per_projector_px < most ? camera_px_per_projector_px : most;  // not finite: from a singular frame
}

/// One for each of the blurs.
std::vector<Appearance> make_appearances(const PatternOptions& pattern, float scale,
                                         std::span<const std::optional<float>> blurs_px) {
  constexpr float kFrameErrors[] = {kExpectedFrameError, kMeasuredFrameError};
  auto made = make_prototypes({.symbols = pattern.symbols,
                               .symbol_size_px = pattern.symbol_size_px,
                               .spacing_px = pattern.spacing_px,
                               .camera_px_per_projector_px = scale},
                              kFrameErrors, blurs_px);
  std::vector<Appearance> appearances;
  for (std::size_t i = 0; i < made.size(); ++i) appearances.emplace_back(blurs_px[i], std::move(made[i]));
  return appearances;
}

}  // namespace

Appearance::Appearance(std::optional<float> blur, PrototypeSets&& made)
    : blur_px(blur),
      as_expected(std::move(made[0])),
      as_measured(std::move(made[1])),
      expected(as_expected, kExpectedDistanceMax),
      measured(as_measured, kMeasuredDistanceMax) {}

Appearances::Appearances(const PatternOptions& pattern, float camera_px_per_projector_px)
    : pattern_(pattern),
      scale_(drawn_scale(pattern, camera_px_per_projector_px)),
      usual_(std::move(make_appearances(pattern, scale_, kAnyBlur).front())) {}

std::shared_ptr<const Appearances> Appearances::shared(const PatternOptions& pattern, float camera_px_per_projector_px,
                                                       std::shared_ptr<const Appearances> known) {
  const auto symbols_of = [](const PatternOptions& of) {
    return std::tie(of.symbols, of.symbol_size_px, of.spacing_px);
  };
  if (known && known->scale_ == drawn_scale(pattern, camera_px_per_projector_px) &&
      symbols_of(known->pattern_) == symbols_of(pattern))
    return known;
  return std::make_shared<const Appearances>(pattern, camera_px_per_projector_px);
}

const std::vector<Appearance>& Appearances::of_blurs() const {
  std::call_once(made_, [&] {
    const float symbol_px = static_cast<float>(pattern_.symbol_size_px) * scale_;
    std::array<std::optional<float>, kBlursPx.size()> blurs_px;
    std::ranges::copy(kBlursPx, blurs_px.begin());
    const auto of_lenses = std::span(blurs_px).subspan(1);
    for (auto& blur_px : of_lenses) *blur_px *= std::max(1.F, symbol_px / kUsualSymbolPx);
    of_blurs_ = make_appearances(pattern_, scale_, std::span(blurs_px).first(1));
    std::ranges::move(make_appearances(pattern_, scale_, of_lenses), std::back_inserter(of_blurs_));
  });
  return of_blurs_;
}

const Appearance& Appearances::likeliest(std::span<const ShapeFeatures> shapes) const {
  constexpr std::size_t kSymbolsMin = 12;
  if (shapes.size() < kSymbolsMin) return usual_;
  static_assert(kShapesMax % kLanes == 0);
  std::array<EightShapes, kShapesMax / kLanes> eights;
  std::array<float, kShapesMax> buffer;
  shapes = shapes.first(std::min(shapes.size(), kShapesMax));
  for (std::size_t i = 0; i < shapes.size(); ++i) eights[i / kLanes].set(static_cast<int>(i % kLanes), shapes[i]);
  const std::span likelihoods = std::span(buffer).first(shapes.size());
  std::size_t best = 0;
  float best_median = -1;
  for (std::size_t blur = 0; blur < kBlursPx.size(); ++blur) {
    const Classifier& classifier = of_blurs()[blur].measured;
    std::array<Classification, kLanes> looks;
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      if (i % kLanes == 0) classifier.classify(eights[i / kLanes], looks);
      likelihoods[i] = looks[i % kLanes].likelihood;
    }
    if (const float median = median_in_place(likelihoods); median > best_median) best = blur, best_median = median;
  }
  return of_blurs()[best];
}

}  // namespace slsd
