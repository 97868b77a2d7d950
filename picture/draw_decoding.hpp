// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/code/pattern.hpp"
#include "core/decode/decoding.hpp"
#include "core/image.hpp"

namespace slsd {

/// The emphasis of the picture of a decoding.
enum class DecodingLook : std::uint8_t { kSymbols, kReasons };

/// Draws the decoder's results (Elahi et al. 2020, figure 9) over the dimmed frame. Decoded symbols are discs in their
/// letter's colour; every other region is a pink plus. Links are thin lines, broken ones red dashes; a legend with
/// counts is below. Enlarges by 2 or 3 if the symbols are small. With kReasons, every undecoded region is a plus in the
/// colour of the rule that rejected it, with the rule's number if there is room. Then the legend names the rules,
/// decoded symbols are small and grey, and there are no links.
/// @param decoding  of this frame; regions outside it are clipped
/// @param pattern   the pattern of the regions' letters
/// @thread reentrant
[[nodiscard]] ColourImage draw_decoding(const GreyView& frame, const Decoding& decoding, const Pattern& pattern,
                                        DecodingLook look = DecodingLook::kSymbols);

/// The colour of a rule in the picture and its legend; neighbours in the list of rules differ most.
[[nodiscard]] Rgb rule_colour(DecodeRule rule);

/// Colour of a letter in the picture and its legend.
/// @param letter  0 to kMaxLetters - 1
[[nodiscard]] Rgb letter_colour(int letter);
inline constexpr Rgb kUndecodedColour{255, 92, 168};
inline constexpr Rgb kLinkColour{150, 166, 190};
inline constexpr Rgb kBrokenLinkColour{255, 64, 52};

}  // namespace slsd
