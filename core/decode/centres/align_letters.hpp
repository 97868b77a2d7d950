// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/appearance/align_patches.hpp"
#include "core/appearance/pattern_field.hpp"
#include "core/code/codebook.hpp"
#include "core/code/pattern.hpp"
#include "core/decode/grid/cell_gate.hpp"
#include "core/decode/grid/sightings.hpp"
#include "core/decode/symbols/prototypes.hpp"
#include "core/executor.hpp"
#include "core/exposure/frame_noise.hpp"
#include "core/image.hpp"

namespace slsd {

/// The letters of a pattern, each dark all round, at some blurs.
/// @thread thread-safe
class LetterFields {
 public:
  explicit LetterFields(const PatternOptions& pattern);
  /// Returns the letters at the nearest blur.
  /// @param blur_px  standard deviation, projector px
  [[nodiscard]] const PatternField& at(float blur_px) const { return fields_.nearest(blur_px); }
  /// Returns the middle of a letter's square in these fields.
  [[nodiscard]] Eigen::Vector2f middle_px(int letter) const;

 private:
  float cell_px_;
  PatternFields fields_;
};

/// A frame, and what the aligner needs to know about it.
struct LetterScene {
  const GreyView& frame;
  double full;  ///< the level of a saturated pixel
  const FrameNoise& noise;
  const PatternField& letters;  ///< blurred as the pattern is in the frame
  const CellGate& gate;         ///< holds the epipolar lines
  std::span<const Prototype> prototypes;
  Sightings& seen;
};

/// Expected position of a symbol, and the light there.
struct LetterPlace {
  Eigen::Vector2f centre_px = Eigen::Vector2f::Zero();  ///< middle of its square in the camera's image
  LatticeFrame frame = LatticeFrame::Zero();
  float background = 0, peak = 0;  ///< grey levels
  int supported_by = 0;            ///< number of neighbours that predict it; 0: there is no place
};

/// One letter in its cell, with the result of its alignment.
struct AskedLetter {
  std::int32_t node;  ///< index in Sightings
  LetterPlace place;
  PatchTask task;
  /// Measured centre of the letter's square, and its centroid, camera px.
  Eigen::Vector2f centre_px = Eigen::Vector2f::Zero(), centroid_px = Eigen::Vector2f::Zero();
  float tilt_px = 0;  ///< shift of the centres of its cell's sides by its tilt relative to the place's, projector px
};

/// Shares of the pixels in a square: pixels that agree with the letter, pixels brighter than its light, and two more.
/// `beside` counts pixels that are lit although the letter is dark there. `darkened` counts pixels that are lit too
/// weakly, as on print.
struct LightShares {
  float agree, brighter, beside, darkened;
  /// Share of the pixels without print that agree. These pixels count as at least two fifths of the square, because
  /// fewer are weak evidence.
  [[nodiscard]] float agree_beside_print() const;
};

/// Aligns letters of known cells with what the frame shows of them. Uses the equations of precision = "fine", eight
/// letters at a time.
/// @thread thread-bound: keeps its buffers; array and letters are shared with copies
class LetterAligner {
 public:
  LetterAligner(const IndexedPattern& pattern, std::shared_ptr<const LetterFields> letters);

  void clear() { asked_.clear(); }
  /// Queues a symbol at a place, unless its cell reaches beyond the frame there.
  void ask(const LetterScene& scene, std::int32_t node, const LetterPlace& place);
  void align(const LetterScene& scene, Executor& executor);
  /// Returns the letters in the order in which they were asked.
  [[nodiscard]] std::vector<AskedLetter>& asked() { return asked_; }
  [[nodiscard]] const std::vector<AskedLetter>& asked() const { return asked_; }

  [[nodiscard]] int letter_of(const CellClaim& claim) const { return array_->at(claim.row, claim.column); }
  [[nodiscard]] LightShares shares_of_middle(const LetterScene& scene, const AskedLetter& asked) const;
  [[nodiscard]] LightShares shares_of_cell(const LetterScene& scene, const AskedLetter& asked) const;
  /// Tells whether the cell has light where its letter has none. Two surfaces that share a cell cause this; print does
  /// not.
  [[nodiscard]] bool shows_other_light(const LetterScene& scene, const AskedLetter& asked) const;
  /// Share of the window or of the cell that agrees, without pixels that print darkens. The larger of the two counts.
  [[nodiscard]] float support_beside_print(const LetterScene& scene, const AskedLetter& asked) const;
  /// Writes the result to the sighting: it now shows its letter, and counts as decoded for now.
  void take_over(const LetterScene& scene, const AskedLetter& asked) const;

 private:
  void align_eight_of(const LetterScene& scene, std::span<AskedLetter> some) const;
  void find_centre(const LetterScene& scene, AskedLetter& asked) const;

  std::shared_ptr<const CodeArray> array_;
  float pitch_px_;
  std::shared_ptr<const LetterFields> letters_;
  std::vector<AskedLetter> asked_;
};

/// Limits on the distance from its epipolar line, projector px, and on the last step along it. A symbol farther off, or
/// still moving, matches by chance.
inline constexpr float kAlignedAcrossMaxPx = 0.4F, kAlignedSettledPx = 0.05F;
/// Largest tilt of an aligned letter. A patch across two surfaces looks more tilted, and its place is on neither.
inline constexpr float kAlignedTiltMaxPx = 0.5F;
/// Smallest share of a cell that must agree, without pixels that print darkens, unless an edge runs through the cell.
inline constexpr float kWholeBesidePrintMin = 0.85F;
/// Limits for a symbol with a single neighbour: it must lie nearer to its line and agree better, without pixels that
/// print darkens.
inline constexpr float kLoneAcrossMaxPx = 0.2F, kLoneSupportMin = 0.85F;

}  // namespace slsd
