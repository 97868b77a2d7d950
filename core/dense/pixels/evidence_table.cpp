// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/pixels/evidence_table.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace slsd {
namespace {

// Model of a pixel's level on a surface, in units of its gain.
constexpr float kMisfit = 0.04F;                               // of the dark: scattered light
constexpr float kGainSpread = 0.12F;                           // of the light: print, relief
constexpr float kPlaceSpread = 0.2F;                           // camera px
constexpr float kOutliers = 0.05F;                             // share of the pixels
constexpr float kLevels = 1.6F, kLevelsEnd = 1.3F;             // over which outliers are spread, and their end
constexpr float kTailLeast = 0.02F;                            // share of the outliers beyond any level
constexpr float kDark = 0.4F, kLit = 0.35F, kBetween = 0.25F;  // levels of a pixel on another surface

float normal(float off, float sigma) {
  return std::exp(-0.5F * off * off / (sigma * sigma)) / (sigma * std::sqrt(2 * std::numbers::pi_v<float>));
}

/// Integral of normal() above a level.
float normal_above(float off, float sigma) {
  return 0.5F * std::erfc(off / (sigma * std::numbers::sqrt2_v<float>));
}

std::uint32_t packed(const Evidence& evidence) {
  const auto half = [](float log) {
    const long steps = std::clamp(std::lround(log / EvidenceTable::kUnit), -32'767L, 32'767L);
    return static_cast<std::uint32_t>(steps) & 0xffffU;
  };
  return half(evidence.against_another) << 16U | half(evidence.against_unlit);
}

Evidence unpacked(std::uint32_t entry) {
  return {static_cast<float>(static_cast<std::int32_t>(entry) >> 16) * EvidenceTable::kUnit,
          static_cast<float>(static_cast<std::int32_t>(entry << 16U) >> 16) * EvidenceTable::kUnit};
}

}  // namespace

Evidence EvidenceTable::reckon(float expected, float seen, float slope, float noise, bool saturated) {
  const auto square = [](float x) { return x * x; };
  const auto sigma = [&](float light, float steep) {
    return std::sqrt(square(noise) + square(kMisfit) + square(kGainSpread * light) + square(kPlaceSpread * steep));
  };
  const auto chance = [&](float light, float steep) {
    const float off = seen - light, spread = sigma(light, steep);
    return saturated ? normal_above(off, spread) : normal(off, spread);
  };
  const float outlier = saturated ? std::clamp((kLevelsEnd - seen) / kLevels, kTailLeast, 1.F) : 1 / kLevels;
  const float here = (1 - kOutliers) * chance(expected, slope) + kOutliers * outlier;
  const float dark = chance(0, 0);
  const float another = kDark * dark + kLit * chance(1, 0) + kBetween * outlier;
  const float unlit = (1 - kOutliers) * dark + kOutliers * outlier;
  return {std::log(here / another), std::log(here / unlit)};
}

EvidenceTable::EvidenceTable() {
  table_.reserve(2 * static_cast<std::size_t>(kOfLight) * kNoises);
  for (int noise = 0; noise < kNoises; ++noise)
    for (const bool saturated : {false, true})
      for (int slope = 0; slope < kSlopes; ++slope)
        for (int expected = 0; expected < kExpected; ++expected)
          for (int seen = 0; seen < kSeen; ++seen)
            table_.push_back(packed(reckon(
                static_cast<float>(expected) / (kExpected - 1), kSeenFirst + kSeenStep * static_cast<float>(seen),
                kSlopeStep * static_cast<float>(slope), kNoiseFirst * static_cast<float>(1 << noise), saturated)));
}

const std::uint32_t* EvidenceTable::entries(float noise) const {
  int loud = 0;
  for (float limit = 1.41F * kNoiseFirst; loud + 1 < kNoises && noise > limit; limit *= 2) ++loud;
  return table_.data() + 2 * static_cast<std::ptrdiff_t>(loud) * kOfLight;
}

Evidence EvidenceTable::at(float expected, float seen, float slope, float noise, bool saturated) const {
  const auto step = [](float value, int count) {
    return static_cast<int>(std::clamp(value + 0.5F, 0.F, static_cast<float>(count - 1)));
  };
  const int row = step(slope / kSlopeStep, kSlopes) * kExpected + step(expected * (kExpected - 1), kExpected);
  const int entry = row * kSeen + step((seen - kSeenFirst) / kSeenStep, kSeen);
  return unpacked(entries(noise)[saturated ? kOfLight + entry : entry]);
}

}  // namespace slsd
