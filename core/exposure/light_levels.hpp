// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <string_view>

#include "core/exposure/tile.hpp"
#include "core/image.hpp"

namespace slsd {

/// Levels of the pattern's light in a frame, in the frame's own units, 0 to `full`.
///
///     full  ------------------------------------
///     lit   ......_____......._____.............   symbols; where clipped, at full
///                |     |     |     |                 edge: how soon the level changes
///     dark  _____|     |_____|     |____________   between them: light of the room, and what the scene scatters
///     0     ------------------------------------
struct LightLevels {
  double full = 255;           ///< level of a saturated pixel
  double dark = 0;             ///< between the symbols, in the middle of all tiles
  double lit = 0;              ///< level of the symbols, in the middle of all tiles
  double lit_brightest = 0;    ///< level of the symbols in the brightest twentieth of the tiles
  double lit_faintest = 0;     ///< level of the symbols in the faintest twentieth
  double clipped_share = 0;    ///< share of the tiles whose symbols are clipped; 0 to 1
  double clipped_of_lit = 0;   ///< share of the symbols' pixels that are saturated; 0 to 1
  double edge_px = 0;          ///< one standard deviation of the blur at the symbols' edges; a sharp edge has about 0.8
  double period_px = 0;        ///< distance from one symbol's edge to the next's on the same side, along rows
  double patterned_share = 0;  ///< share of the tiles in which the pattern is visible; 0 to 1. If it is 0, only `full`
                               ///< of the above is valid

  [[nodiscard]] double contrast() const { return lit - dark; }
  /// Light between the symbols relative to the pattern's own.
  [[nodiscard]] double room_light() const { return contrast() > 0 ? dark / contrast() : 0; }
};

/// Sums up the tiles of a frame.
/// @param all  number of tiles, with those that show no pattern
/// @thread reentrant
[[nodiscard]] LightLevels summarize(std::span<const PatternedTile> tiles, int all, double full);

/// Measures the visibility of the pattern tile by tile, 64 px wide. Needs no calibration and no decoder, so it works on
/// frames that cannot be decoded.
/// @param frame  taken while the pattern was shown
/// @param full   the level of a saturated pixel: 255, 1023, 65535...
/// @thread reentrant
[[nodiscard]] LightLevels measure_light(const GreyView& frame, double full);

/// Guesses the level of a saturated pixel: 255, or for 16 bits the least of 1023, 4095, 16383 and 65535 that no pixel
/// exceeds. If no pixel of a frame reaches a quarter of full, the guess is too low. The decoder then accepts fainter
/// light as the pattern, and intensities come out brighter.
/// @thread reentrant
[[nodiscard]] double guess_full_level(const GreyView& frame);

/// The level of a saturated pixel of one camera, over many frames: a faint frame after a bright one has no fewer bits.
/// The level may rise once a pixel exceeds it, and never falls.
/// @thread thread-bound
class HeldFullLevel {
 public:
  /// 255, or for 16 bits the greatest guess over this and the previous frames.
  [[nodiscard]] double of(const GreyView& frame);

 private:
  double greatest_ = 0;
};

/// The level of a saturated pixel. Formats that leave the upper bits of 16 empty have their bit depth as the first
/// number in their names: "Y10", "Mono12", "Mono10p", "BayerRG12Packed". Names of 16-bit formats do not tell: the
/// content may have fewer bits.
/// @param format  the camera's name for it; if it does not tell, or a pixel exceeds its level, guess_full_level()
///                decides
/// @thread reentrant
[[nodiscard]] double full_level(std::string_view format, const GreyView& frame);

/// The same for several frames of one camera: a guess from a dark frame alone would be too low. 0 without frames.
/// @thread reentrant
[[nodiscard]] double full_level(std::string_view format, std::span<const GreyView> frames);

}  // namespace slsd
