// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>

#include "core/image.hpp"
#include "core/regions/mask.hpp"

namespace slsd {

using Histogram = std::array<std::uint32_t, 256>;

/// Otsu's threshold: the highest grey value of dark pixels that gives the greatest variance between dark and lit; the
/// lowest such value on a tie. Otsu 1979; Elahi et al. 2020, section III A.
/// @return 0 if all pixels are equal
/// @thread reentrant
[[nodiscard]] int otsu_threshold(const Histogram& histogram);

/// Separates lit from dark by the paper's method: stretches the contrast between the darkest and the lightest 0.1 %,
/// removes noise by a 3x3 median, and applies one Otsu threshold to the whole frame. Fails if light falls off over the
/// frame. Elahi et al. 2020, section III A.
/// @param frame  8 or 16 bits a pixel
/// @return all dark if all pixels of the frame are equal
/// @thread reentrant
[[nodiscard]] Mask binarize_paper(const GreyView& frame);

}  // namespace slsd
