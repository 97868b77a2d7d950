// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "core/image.hpp"
#include "core/lanes.hpp"
#include "core/regions/find_regions.hpp"

namespace slsd {

/// Ends of the soft threshold between a region's background and its peak. For a shape, the upper end is the level that
/// the bright part still exceeds under print, shading or a camera's gamma. The shape is the lit area, whatever its
/// brightness.
inline constexpr float kRampStart = 0.1F;
inline constexpr float kRampEnd = 0.3F;
/// Ends of the ramp for the centre. They are symmetric about the middle and as wide as background and peak allow, so
/// blur does not move the centre. On planes at 2 m the error is 0.09 mm, compared to 0.16 mm with an asymmetric ramp.
inline constexpr float kCentreRampStart = 0.2F;
inline constexpr float kCentreRampEnd = 0.8F;
/// Upper end of the ramp in light that changes within the symbol: less bright pixels then count in full.
inline constexpr float kSteadyRampEnd = 0.65F;

/// Patch pixels that belong to others: every comparison with NaN is false.
inline constexpr float kOutside = std::numeric_limits<float>::quiet_NaN();

/// Least and greatest grey value of a patch.
struct PatchRange {
  float least = std::numeric_limits<float>::max(), greatest = 0;
};

/// Background and peak of a patch, the means of the lowest and the highest quarter of its range: single noisy pixels do
/// not move them.
struct PatchLevels {
  float background = 0, peak = 0;
};

/// @param patch  grey values or kOutside
/// @param count  a multiple of kLanes
/// @thread reentrant
[[nodiscard]] PatchRange range_of(const float* patch, int count);
void find_levels(const float* patch, int count, const PatchRange& range, PatchLevels& levels);

/// Raw moments of a patch: the sum of w x^p y^q in [p][q]. w is the soft threshold's weight of a pixel, 0 to 1.
struct RawMoments {
  float m[4][4] = {};
  float centre = 0, centre_x = 0, centre_y = 0;  ///< the sums of w, w x and w y through the centre's ramp
  float steady = 0, steady_x = 0, steady_y = 0;  ///< the same through the ramp for uneven light, if measured
};

/// Selects whether to measure also the centre with less pull from uneven light, which few symbols need.
enum class SteadyCentre : std::uint8_t { kLeftOut, kMeasured };

/// A row's y from the patch's centre, and its powers.
struct RowPowers {
  float y, yy, yyy;
};

/// @param stride    columns of the patch, a multiple of kLanes
/// @param rows      one for each row of the patch
/// @param middle_x  origin of x, from the first pixel's centre
/// @param moments   including the steady centre
/// @thread reentrant
void sum_moments(const float* patch, int stride, std::span<const RowPowers> rows, float middle_x,
                 const PatchLevels& levels, RawMoments& moments);

/// A region of an 8-bit frame, and its moments.
struct WeighedRegion {
  static constexpr std::size_t kAtOnce = 8;
  const Region* region;
  const Run* runs;
  PatchLevels levels{};
  RawMoments moments{};  ///< about the centre of the region's box; zero if the peak is not above the background
};
/// Tells whether a region's patch is small enough, and lies in the frame.
/// @thread reentrant
[[nodiscard]] bool can_be_weighed(const ImageView<std::uint8_t>& frame, const Region& region, int margin_px);
/// Does all steps for several regions at once, in 16 bits a pixel: half the memory, and twice the pixels per register.
/// @param margin_px  reach of a region's patch beyond the region's pixels
/// @param regions    at most WeighedRegion::kAtOnce
/// @thread reentrant
void weigh_regions(const ImageView<std::uint8_t>& frame, int margin_px, SteadyCentre steady,
                   std::span<WeighedRegion> regions);

}  // namespace slsd
