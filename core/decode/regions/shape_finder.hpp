// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/code/pattern.hpp"
#include "core/decode/decoding.hpp"
#include "core/decode/grid/lattice_frame.hpp"
#include "core/decode/grid/sightings.hpp"
#include "core/decode/options.hpp"
#include "core/decode/regions/binarize.hpp"
#include "core/decode/regions/separate_regions.hpp"
#include "core/decode/regions/sharpen.hpp"
#include "core/decode/symbols/grey_moments.hpp"
#include "core/geometry/measured_box.hpp"
#include "core/regions/find_regions.hpp"
#include "core/regions/mask.hpp"

namespace slsd {

/// The first stages of a frame, from the grey values to the shapes whose size and contrast may be those of symbols.
/// They do not depend on the pattern's choice of symbols.
/// @thread thread-bound
class ShapeFinder {
 public:
  /// @param expected  local frames of the pattern, to half a step of the grid
  ShapeFinder(const PatternOptions& pattern, ExpectedFrames expected, Method binarize, Method find_regions,
              Rules rules = {});

  /// Replaces the expected frames by others of the same scale, to an eighth.
  void expect(ExpectedFrames expected) { expected_ = std::move(expected); }
  [[nodiscard]] const ExpectedFrames& expected() const { return expected_; }
  /// Finds shapes among these pixels of the frame only; empty: among all. Noise, blur and thresholds are those of the
  /// whole frame.
  void set_part(const std::optional<PixelRectangle>& part) { part_ = part; }

  /// Sharpens a frame that is out of focus first.
  /// @param full  the level of a saturated pixel of the frame
  /// @return      the image for the later stages, which is the frame itself or its sharpened copy; valid until the next
  ///              call
  /// @param noise  noise of the frame, if it is known better than it can be measured
  GreyView binarize(const GreyView& frame, double full, Executor& executor,
                    const std::optional<FrameNoise>& noise = std::nullopt);
  void find_regions(const GreyView& frame, Executor& executor);
  /// Replaces the sightings by the shapes that may be symbols.
  void describe(const GreyView& frame, Executor& executor, Sightings& seen);

  [[nodiscard]] const Mask& mask() const { return mask_; }
  [[nodiscard]] const Regions& regions() const { return regions_; }
  /// Reason why a region is no sighting; kNoNeighbour for a sighting.
  [[nodiscard]] DecodeRule rule(std::size_t region) const { return rule_[region]; }
  /// One for each worker.
  [[nodiscard]] std::span<GreyMomentMeter> meters() { return meters_; }
  /// Levels of the frame per level of 255.
  [[nodiscard]] float frame_levels() const { return frame_levels_; }
  /// Returns the noise of the frame that binarize() returned.
  [[nodiscard]] const FrameNoise& noise() const { return noise_; }
  /// Blur at the sharpest edges of the frame itself, one standard deviation; 0 if there are none, or by the paper's
  /// way.
  [[nodiscard]] float edge_blur_px() const { return edge_blur_px_; }

 private:
  [[nodiscard]] PixelRectangle part() const;
  GreyView binarize_blurred(const GreyView& frame, double full, Executor& executor);
  GreyView binarize_faint(const GreyView& frame, double full, Executor& executor);
  [[nodiscard]] float scale_at(const Region& region) const;
  [[nodiscard]] bool is_too_large(const Region& region, float scale) const;
  [[nodiscard]] DecodeRule judge_size(const Region& region) const;

  float symbol_size_px_, pitch_px_;
  Method binarize_, find_regions_;
  Rules rules_;
  ExpectedFrames expected_;
  Binarizer binarizer_;
  Sharpener sharpener_;
  RegionFinder region_finder_;
  RegionSeparator separator_;
  std::vector<GreyMomentMeter> meters_;
  std::optional<PixelRectangle> part_;

  Mask mask_;
  Regions regions_;
  std::vector<DecodeRule> rule_;
  FrameNoise noise_;
  float frame_levels_ = 1, edge_blur_px_ = 0;
};

}  // namespace slsd
