// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/appearance/align_patches.hpp"
#include "core/appearance/blurred_pattern.hpp"
#include "core/appearance/tone_curve.hpp"

namespace slsd {

/// A patch's knowledge of the blur and of the tone curve.
struct PatchBlur {
  float change, weight;            ///< of the blur's variance, projector px^2, and its weight
  float variance;                  ///< of the patch's blur, projector px^2
  float tone_change, tone_weight;  ///< of the tone curve's power; the weight is 0 if the patch knows nothing of it
};

/// @param task  a patch that was aligned with the field
/// @param full  the level of a saturated pixel, see Censored
/// @return empty if the patch knows nothing of the blur
/// @thread reentrant
[[nodiscard]] std::optional<PatchBlur> blur_of_patch(const GreyView& frame, double full, const PatternField& field,
                                                     const AlignOptions& options, const CellTask& task);

/// Measures from aligned patches how much wider or narrower the frame's blur is than the field's. A change s of the
/// blur's variance changes the pattern by s/2 times its Laplacian (the heat equation). This is one more unknown of the
/// aligner's equations, the same for all patches, while each has its own place and light. Measures also the camera's
/// tone curve, which is another unknown: levels that are the light to a power, see ToneCurve.
/// @thread thread-bound: keeps its buffers
class BlurMeter {
 public:
  void clear() { patches_.clear(), tones_.clear(); }
  void add(const PatchBlur& patch);
  /// Change of the variance, projector px^2: the median of the patches, weighted by what each knows. Empty without a
  /// patch that knows anything.
  [[nodiscard]] std::optional<float> change() { return weighted_median(patches_); }
  /// Change of the power, likewise: 0 for levels that are proportional to the light.
  [[nodiscard]] std::optional<float> tone_change() { return weighted_median(tones_); }

 private:
  using Weighted = std::vector<std::pair<float, float>>;  // values, and their weights
  [[nodiscard]] static std::optional<float> weighted_median(Weighted& values);

  Weighted patches_, tones_;
};

/// Standard deviation after a change of the variance: between 2/3 and 3/2 of the old one, for the equations are linear
/// only nearby, and in PatternFields' range.
[[nodiscard]] float changed_blur_px(float blur_px, float change);

/// Patches of a frame aligned with a field, and the blur that they ask for.
struct BlurSeen {
  std::size_t aligned = 0, tried = 0;  ///< number of patches
  float blur_px = 0;                   ///< standard deviation, projector px; the field's own if no patch knows it
  float tone_change = 0;               ///< see BlurMeter; 0 if no patch knows it
};

/// Finds a frame's blur, projector px: from a usual one, until the blur rests. If most patches fail at the usual blur,
/// the search starts at the wider one where most are aligned.
/// @param look  BlurSeen(const PatternField&)
template <class Look>
[[nodiscard]] float find_blur(const PatternFields& fields, Look&& look) {
  constexpr int kRoundsMost = 8;
  constexpr float kOnTheWay = 0.04F;  // nearer to its own blur, a frame needs no other field
  BlurSeen seen = look(fields.usual());
  if (2 * seen.aligned < seen.tried) {
    for (std::size_t rung = PatternFields::kUsualRung + 2; rung < PatternFields::kLadderPx.size(); rung += 2)
      if (const BlurSeen other = look(fields.rung(rung)); other.aligned > seen.aligned) seen = other;
  }
  std::shared_ptr<const PatternField> field = fields.at(seen.blur_px, kOnTheWay), before;
  for (int round = 0; round < kRoundsMost; ++round) {
    seen = look(*field);
    auto next = fields.at(seen.blur_px, kOnTheWay);
    // Between two fields, a blur may ask for each of them in turn.
    if (next == field || next == before) break;
    before = std::exchange(field, std::move(next));
  }
  return seen.blur_px;
}

/// Finds the blur and the camera's tone curve in turn, from a straight curve, until the curve rests.
/// @param develop  void(): makes the light of the frame, which look() looks at, by the present curve
/// @param look     as for find_blur()
template <class Develop, class Look>
[[nodiscard]] float find_blur_and_tone(const PatternFields& fields, ToneCurve& tone, Develop&& develop, Look&& look) {
  constexpr int kRoundsMost = 4;
  constexpr float kAtRest = 0.02F;
  float blur_px = 0;
  tone.set_power(1);
  for (int round = 0; round < kRoundsMost; ++round) {
    develop();
    float change = 0;
    blur_px = find_blur(fields, [&](const PatternField& tried) {
      const BlurSeen seen = look(tried);
      change = seen.tone_change;
      return seen;
    });
    const float power = tone.power();
    tone.set_power(power * (1 + change));
    if (std::abs(tone.power() - power) < kAtRest || round + 1 == kRoundsMost) {
      tone.set_power(power);
      break;
    }
  }
  return blur_px;
}

/// Finds the pattern as a frame shows it, if its usual blur is known. An uneven blur is measured again with the fields
/// that it asks for: the equations are linear only near a field's blur.
/// @param look     BlurSeen(const BlurredPattern&)
/// @param samples  std::span<const BlurSample>(): the blur at the patches of the last look
template <class Look, class Samples>
[[nodiscard]] BlurredPattern find_pattern(const PatternFields& fields, float blur_px, Look&& look, Samples&& samples) {
  BlurredPattern pattern(fields, blur_px, samples());
  if (pattern.levels() == 1) return pattern;
  (void)look(pattern);
  return {fields, blur_px, samples()};
}

}  // namespace slsd
