// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "core/code/pattern.hpp"
#include "core/decode/symbols/classify.hpp"
#include "core/decode/symbols/prototypes.hpp"

namespace slsd {

/// Look of a pattern's symbols, in the frames that the calibration predicts and in those measured from their
/// neighbours.
struct Appearance {
  std::optional<float> blur_px;  ///< blur of projector and camera together, camera px; if missing, all blurs that occur
  std::vector<Prototype> as_expected, as_measured;
  Classifier expected, measured;

  /// @param made  prototypes in expected frames and in measured ones
  Appearance(std::optional<float> blur, PrototypeSets&& made);
};

/// Appearances at each blur that occurs. The soft threshold is low, so that it includes faint light on print. It also
/// includes more of a blurred symbol, so the look depends on the blur.
/// @thread reentrant: those of the blurs are made on first use, once for all who share this object
class Appearances {
 public:
  Appearances(const PatternOptions& pattern, float camera_px_per_projector_px);
  /// Returns the known appearances if they are of this pattern's symbols at this scale, and makes new ones otherwise,
  /// which takes tenths of a second.
  /// @param known  may be null
  [[nodiscard]] static std::shared_ptr<const Appearances> shared(const PatternOptions& pattern,
                                                                 float camera_px_per_projector_px,
                                                                 std::shared_ptr<const Appearances> known);

  /// Returns the appearance over every blur that occurs, for uses that do not depend on it.
  [[nodiscard]] const Appearance& usual() const { return usual_; }

  static constexpr std::size_t kShapesMax = 512;
  /// Finds the appearance in which half of the shapes are the likeliest; the usual one if there are too few shapes.
  /// @param shapes  a sample from the frame, in measured frames; at most kShapesMax of them are used
  [[nodiscard]] const Appearance& likeliest(std::span<const ShapeFeatures> shapes) const;

 private:
  /// Standard deviations, camera px: first of a drawn frame, then of lenses. Larger symbols come with larger blurs.
  static constexpr std::array kBlursPx{0.2F, 0.45F, 0.7F, 1.0F, 1.4F, 2.0F};
  static constexpr float kUsualSymbolPx = 24;
  [[nodiscard]] const std::vector<Appearance>& of_blurs() const;

  PatternOptions pattern_;
  float scale_;
  Appearance usual_;
  mutable std::once_flag made_;
  mutable std::vector<Appearance> of_blurs_;
};

}  // namespace slsd
