// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>

#include "core/decode/regions/mask.hpp"
#include "core/image.hpp"

namespace slsd {

using Histogram = std::array<std::uint32_t, 256>;

/// The grey value up to which pixels are dark, so that the variance between the dark and the lit is greatest; the
/// lowest such value.
/// Otsu 1979; Elahi et al. 2020, section III A.
/// @return 0 where all pixels are equal
/// @thread reentrant
[[nodiscard]] int otsu_threshold(const Histogram& histogram);

/// Separates lit from dark the paper's way: contrast stretched between the darkest and the lightest 0.1 %, noise
/// removed by a 3x3 median, one threshold for the whole frame by Otsu's method. Fails where light falls off over the
/// frame. Elahi et al. 2020, section III A.
/// @param frame  8 or 16 bits a pixel
/// @return all dark for a frame of one grey value
/// @thread reentrant
[[nodiscard]] Mask binarize_paper(const GreyView& frame);

}  // namespace slsd
