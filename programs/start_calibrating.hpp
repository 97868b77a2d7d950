// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/result.hpp"

namespace slsd {

inline constexpr const char* kCalibrator = "slsd-calibrate";

/// Becomes slsd-calibrate, with the same command line: a program of its own, so that the service carries none of the
/// libraries that only calibrating needs.
/// @param argv  as main() was given it
/// @return      only where that fails. @errors kNotFound where it is not installed
[[nodiscard]] Result<> start_calibrating(char** argv);

}  // namespace slsd
