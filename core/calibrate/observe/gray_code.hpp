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
/// followed by its inverse. White and black belong to the code but are not included.
[[nodiscard]] std::vector<Grey8> draw_gray_code(const ImageSize& projector);
[[nodiscard]] std::size_t gray_code_images(const ImageSize& projector);

/// One camera's images of the code.
struct GrayCapture {
  GreyView white, black;
  std::vector<GreyView> code;  ///< gray_code_images() of them
};

/// The projector pixels that the camera sees. Every certain pixel counts: the means over a projector square's camera
/// and projector pixels form a pair. Stripes too fine for a projector out of focus are ignored.
/// @param wanted  whether to use a camera pixel
/// @errors kMismatch: the number of images, their sizes, their order or the projector's size are inconsistent
/// @thread reentrant
[[nodiscard]] Result<std::vector<ProjectedPoint>> read_gray_code(const GrayCapture& capture, const ImageSize& projector,
                                                                 const std::function<bool(int x, int y)>& wanted);

}  // namespace slsd
