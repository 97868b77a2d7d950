// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <functional>
#include <optional>

#include "core/exposure/frame_noise.hpp"
#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

/// The level of a quotient where the pattern is as bright as white, and that of a saturated pixel.
inline constexpr double kAsBrightAsWhite = 50000, kQuotientFull = 65535;

/// The pattern's image divided by the white one: what is printed on a surface, and how the light falls on it, goes out;
/// what is left is the pattern. Where the white image is hardly above its noise there is nothing to see, and the
/// quotient goes to 0.
/// @param pattern  of the same size as white
/// @param dark     with the projector black: the light of the room, which is taken from both
/// @return 16 bits; 50000 where the pattern is as bright as white
/// @errors kMismatch: the images are not of the same size
/// @thread reentrant
[[nodiscard]] Result<Grey16> divide_light(const GreyView& pattern, const GreyView& white,
                                          const std::optional<GreyView>& dark = std::nullopt);

/// Known properties of a surface with a print on it, whose edges are sharp.
struct PrintedSurface {
  std::function<bool(int x, int y)> contains;  ///< the pixels that show it
  double blur_px = 0;  ///< one standard deviation of the blur at the print's edges; 0: not known
};

struct DividedPrint {
  Grey16 quotient;
  /// Noise of the quotient on the print's ink. On paper there is less at the same level: the quotient's levels cannot
  /// show it.
  FrameNoise noise;
};

/// The same to fractions of a pixel at the print's edges, where there is no dark image. Two things of the camera stay
/// in a plain quotient, and pull what lies across an edge towards the ink:
///
/// - The level of a pixel without light, on top of which both images lie. It is a larger share of what little light ink
///   gives back, so that the dark of the pattern is brighter there than on paper. It is found by that.
/// - The camera's blur. What a pixel shows of the pattern is not what is there but what is where most of its light
/// comes
///   from: with a Gaussian blur s and a white image W, farther by s^2 grad W / W. The quotient is moved back by that.
[[nodiscard]] Result<DividedPrint> divide_light(const GreyView& pattern, const GreyView& white,
                                                const PrintedSurface& surface);

}  // namespace slsd
