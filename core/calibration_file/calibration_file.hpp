// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <string_view>

#include "core/geometry/calibration.hpp"
#include "core/result.hpp"

namespace slsd {

/// Reads a calibration file's text (OpenCV FileStorage YAML, keys in docs/formats.md).
/// @errors kMalformed, kInvalidArgument: the message names the key
[[nodiscard]] Result<Calibration> read_calibration(std::string_view text, std::string_view name);
[[nodiscard]] std::string write_calibration(const Calibration& calibration);

}  // namespace slsd
