// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "core/cloud/cloud.hpp"
#include "core/colour.hpp"
#include "core/image.hpp"

namespace slsd {

/// Share of the full level above which a pixel is saturated: noise and uneven pixels keep some below the full level.
inline constexpr double kSaturatedShare = 0.985;

/// Frames of a camera without the pattern, with the size and depth of its other frames.
struct SceneLight {
  std::optional<GreyView> white = {};          ///< while the projector showed white
  std::optional<GreyView> dark = {};           ///< while it showed black: the light of the room alone
  double full = 255;                           ///< the level of a saturated pixel
  const ColourFrame* white_colours = nullptr;  ///< colours of the white frame; null: the camera sees none
  const ColourFrame* dark_colours = nullptr;
  double colour_full = 255;  ///< the level of a saturated pixel in the colours
  ColourGains gains{1, 1, 1};
};

/// Levels of red, green and blue at a place.
struct ColourSample {
  std::array<double, 3> levels{};
  double highest = 0;  ///< of all levels that these come from
};

/// The levels at a place between four pixels.
[[nodiscard]] ColourSample sample_colours(const ColourFrame& colours, double u, double v);

/// The colour of a surface from its levels under white, minus those of the dark frame, times the gains, 0 to 255.
/// White if a level is saturated: then the colour is unknown.
/// @param saturated  set if it is; else left alone
[[nodiscard]] Rgb colour_of(const ColourSample& white, const ColourSample& dark, const SceneLight& light,
                            bool& saturated);

/// Gives points the intensity of the white frame at their positions, minus the dark frame's, 0 to 255 of full. Without
/// a white frame, it subtracts the dark level from the points' own intensity, which is the symbol's. If a white pixel
/// around a point is saturated, only a lower bound is known, and the intensity is 255. With colours of the white frame,
/// points get these likewise, and white if one is saturated; without, their colour is the intensity.
/// @param points  points of that camera alone, within its frame
/// @return        number of points whose intensity or colour is saturated
/// @thread reentrant
std::size_t shade_points(std::span<CloudPoint> points, const SceneLight& light);

/// The factors that make the mean colour of these points grey. Empty: the mean lacks a colour. Saturated points are
/// left out.
/// @param applied  the factors in their colours
/// @thread reentrant
[[nodiscard]] std::optional<ColourGains> white_balance_of(std::span<const CloudPoint> points,
                                                          const ColourGains& applied);

}  // namespace slsd
