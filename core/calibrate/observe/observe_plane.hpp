// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>

#include "core/calibrate/observe/gray_code.hpp"
#include "core/calibrate/observe/observations.hpp"
#include "core/decode/pattern_reader.hpp"
#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

/// Reads the pattern wherever it is seen in a picture, for a plain plane without a board.
/// @param white  what is printed on the plane and how the light falls on it are divided out, where it is there
/// @return without corners
/// @errors kMismatch: the pictures are not of the same size; kNotFound: none of the pattern is seen; kUnsupported: too
///         large
[[nodiscard]] Result<PoseView> observe_plane(const GreyView& pattern, const std::optional<GreyView>& white,
                                             PatternReader& reader);

/// The same with a Gray code. @errors kMismatch; kNotFound @thread reentrant
[[nodiscard]] Result<PoseView> observe_plane(const GrayCapture& capture, const ImageSize& projector);

}  // namespace slsd
