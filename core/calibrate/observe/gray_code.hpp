// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "core/calibrate/observe/observations.hpp"
#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

/// The images of a Gray code, in the order of OpenCV's GrayCodePattern: columns first, the highest bit first, each bit
/// followed by its inverse. White and black belong to it and are not among them.
[[nodiscard]] std::vector<Grey8> draw_gray_code(const ImageSize& projector);
[[nodiscard]] std::size_t gray_code_images(const ImageSize& projector);

/// One camera's images of the code.
struct GrayCapture {
  GreyView white, black;
  std::vector<GreyView> code;  ///< gray_code_images() of them
};

/// The projector pixels that the camera sees. Every pixel that is certain has a part: those of a square of the
/// projector are taken together, and their means belong to each other. Stripes too fine for a projector out of focus
/// are left out.
/// @param wanted  whether a camera pixel is asked for
/// @errors kMismatch: the count of images, their sizes, their order or the projector's size do not fit
/// @thread reentrant
[[nodiscard]] Result<std::vector<ProjectedPoint>> read_gray_code(const GrayCapture& capture, const ImageSize& projector,
                                                                 const std::function<bool(int x, int y)>& wanted);

}  // namespace slsd
