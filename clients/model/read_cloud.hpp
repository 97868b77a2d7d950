// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string_view>
#include <vector>

#include "clients/model/range_image.hpp"
#include "core/result.hpp"

namespace slsd::model {

/// Reads a dense cloud as slsd writes it: docs/formats.md, PLY.
/// @errors kMalformed: no such file, or cut; kUnsupported: a point for each symbol
/// @thread reentrant
[[nodiscard]] Result<std::vector<MeasuredPoint>> read_cloud(std::string_view bytes);

}  // namespace slsd::model
