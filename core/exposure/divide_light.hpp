// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <functional>
#include <optional>

#include "core/exposure/frame_noise.hpp"
#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

/// Level of a quotient if the pattern is as bright as white, and level of a saturated pixel.
inline constexpr double kAsBrightAsWhite = 50000, kQuotientFull = 65535;

/// Divides the pattern's image by the white one. This removes the print on a surface and the distribution of the light,
/// and keeps the pattern. If the white image is hardly above its noise, the quotient goes to 0.
/// @param pattern  of the same size as white
/// @param dark     taken with the projector black: the light of the room, which is subtracted from both
/// @return 16 bits; 50000 if the pattern is as bright as white
/// @errors kMismatch: the images differ in size
/// @thread reentrant
[[nodiscard]] Result<Grey16> divide_light(const GreyView& pattern, const GreyView& white,
                                          const std::optional<GreyView>& dark = std::nullopt);

/// Known properties of a surface with a print on it, whose edges are sharp.
struct PrintedSurface {
  std::function<bool(int x, int y)> contains;  ///< the pixels that show the surface
  double blur_px = 0;                          ///< one standard deviation of the blur at the print's edges; 0: unknown
};

struct DividedPrint {
  Grey16 quotient;
  /// Noise of the quotient on the print's ink. On paper it is lower at the same level, which a function of the
  /// quotient's level cannot express.
  FrameNoise noise;
};

/// The same, accurate to fractions of a pixel at the print's edges, for captures without a dark image. A plain quotient
/// contains two errors of the camera, which pull places across an edge towards the ink:
///
/// - The black level, which is part of both images. Ink reflects little light, so the black level is a larger share of
///   it, and the dark pattern appears brighter there than on paper. This difference gives the black level.
/// - The camera's blur. A pixel shows the pattern not at its own place, but at the place that most of its light comes
///   from: for a Gaussian blur s and a white image W, farther by s^2 grad W / W. The quotient is corrected for that.
[[nodiscard]] Result<DividedPrint> divide_light(const GreyView& pattern, const GreyView& white,
                                                const PrintedSurface& surface);

}  // namespace slsd
