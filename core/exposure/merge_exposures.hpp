// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/exposure/light_levels.hpp"
#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

/// The level of a saturated pixel in a merged frame.
inline constexpr double kMergedFull = 65535;

/// Two exposures of one scene as one frame, in proportion to the levels of the shorter one.
struct MergedExposures {
  Grey16 image;             ///< a pixel saturated in the shorter frame has kMergedFull
  double brighter = 1;      ///< measured: levels of the longer frame per level of the shorter
  double unlike_share = 0;  ///< share of the pixels that differ beyond noise; they keep the shorter frame's level
};

/// Merges two exposures into a frame with less noise where it is dark. A pixel is the mean of both, weighted by the
/// inverse variances that the frames themselves show, or the shorter frame's if the longer one is saturated. A level
/// of one frame alone is spread evenly over its rounding.
///
///     longer = offset + brighter * shorter       fitted to all means of 8 x 8 unsaturated pixels: a camera's black
///     level
///                                                and rounded exposures cancel
///
/// @param shorter, longer  of one camera, size and depth
/// @param full             the level of a saturated pixel in both
/// @param ratio            of the exposure times, longer to shorter, above 1
/// @errors kInvalidArgument: the ratio or the full level; kMismatch: sizes or depths differ, the brightness does not
///         follow the exposure, or more than a hundredth of the pixels moved
/// @thread reentrant
[[nodiscard]] Result<MergedExposures> merge_exposures(const GreyView& shorter, const GreyView& longer, double full,
                                                      double ratio);

/// Two exposures of one picture: of the pattern, of white or of black.
struct ExposurePair {
  GreyView shorter;
  GreyView longer;
};

/// The pictures of one camera, each as one frame with kMergedFull as the level of a saturated pixel.
struct MergedPictures {
  std::vector<Grey16> images;  ///< one for each pair
  std::string problem;         ///< why they are the shorter exposures alone; empty: all pairs are merged
};

/// Merges all pictures of a camera, or none: their levels must be comparable.
/// @param pairs  of one scene
/// @param full, ratio  as for merge_exposures()
/// @thread reentrant
[[nodiscard]] MergedPictures merge_pictures(std::span<const ExposurePair> pairs, double full, double ratio);

/// Tells whether a second exposure would help: symbols are clipped in more than a twentieth of the pattern, and the
/// faintest are darker than an eighth of full level, so that no single exposure suits both.
/// @thread reentrant
[[nodiscard]] bool needs_second_exposure(const LightLevels& levels);

/// Converts one exposure to the levels of a merged frame.
/// @thread reentrant
[[nodiscard]] Grey16 as_merged(const GreyView& frame, double full);

}  // namespace slsd
