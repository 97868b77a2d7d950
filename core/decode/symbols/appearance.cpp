// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbols/appearance.hpp"

#include <algorithm>
#include <utility>

#include "core/lanes.hpp"

namespace slsd {
namespace {

/// Errors of local frames: an expected frame ignores the tilt of the surface; a measured one has noise and curvature.
constexpr float kExpectedFrameError = 0.15F;
constexpr float kMeasuredFrameError = 0.05F;
/// Distance from the nearest prototype, in standard deviations, beyond which a shape is none of the pattern's symbols.
constexpr float kExpectedDistanceMax = 25;
constexpr float kMeasuredDistanceMax = 20;

std::vector<std::vector<Prototype>> make(const PatternOptions& pattern, float scale, std::optional<float> blur_px) {
  constexpr float kFrameErrors[] = {kExpectedFrameError, kMeasuredFrameError};
  return make_prototypes({.symbols = pattern.symbols,
                          .symbol_size_px = pattern.symbol_size_px,
                          .spacing_px = pattern.spacing_px,
                          .camera_px_per_projector_px = scale,
                          .blur_px = blur_px},
                         kFrameErrors);
}

}  // namespace

Appearance::Appearance(const PatternOptions& pattern, float camera_px_per_projector_px, std::optional<float> blur)
    : Appearance(blur, make(pattern, camera_px_per_projector_px, blur)) {}

Appearance::Appearance(std::optional<float> blur, std::vector<std::vector<Prototype>>&& made)
    : blur_px(blur),
      as_expected(std::move(made[0])),
      as_measured(std::move(made[1])),
      expected(as_expected, kExpectedDistanceMax),
      measured(as_measured, kMeasuredDistanceMax) {}

Appearances::Appearances(const PatternOptions& pattern, float camera_px_per_projector_px)
    : pattern_(pattern),
      scale_(camera_px_per_projector_px),
      usual_(pattern, camera_px_per_projector_px, std::nullopt) {}

const Appearance& Appearances::at(std::size_t blur) const {
  std::call_once(made_[blur], [&] {
    const float symbol_px = static_cast<float>(pattern_.symbol_size_px) * scale_;
    const float times = blur == 0 ? 1 : std::max(1.F, symbol_px / kUsualSymbolPx);
    appearances_[blur] = std::make_unique<const Appearance>(pattern_, scale_, times * kBlursPx[blur]);
  });
  return *appearances_[blur];
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
  const auto middle = likelihoods.begin() + static_cast<std::ptrdiff_t>(likelihoods.size() / 2);
  std::size_t best = 0;
  float best_median = -1;
  for (std::size_t blur = 0; blur < kBlursPx.size(); ++blur) {
    const Classifier& classifier = at(blur).measured;
    std::array<Classification, kLanes> looks;
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      if (i % kLanes == 0) classifier.classify(eights[i / kLanes], looks);
      likelihoods[i] = looks[i % kLanes].likelihood;
    }
    std::ranges::nth_element(likelihoods, middle);
    if (*middle > best_median) best = blur, best_median = *middle;
  }
  return at(best);
}

}  // namespace slsd
