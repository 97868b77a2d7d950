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

/// Reads the pattern anywhere in a picture, for a blank plane without a board.
/// @param white  if given, the print on the plane and the light on it are divided out
/// @return a view without corners
/// @errors kMismatch: the pictures differ in size; kNotFound: the pattern is not visible; kUnsupported: too large
[[nodiscard]] Result<PoseView> observe_plane(const GreyView& pattern, const std::optional<GreyView>& white,
                                             PatternReader& reader);

/// The same with a Gray code. @errors kMismatch; kNotFound @thread reentrant
[[nodiscard]] Result<PoseView> observe_plane(const GrayCapture& capture, const ImageSize& projector);

}  // namespace slsd
