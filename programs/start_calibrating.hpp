// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/result.hpp"

namespace slsd {

inline constexpr const char* kCalibrator = "slsd-calibrate";

/// Replaces this process by slsd-calibrate with the same command line. It is a separate program, so that the service
/// does not load libraries that only calibrating needs.
/// @param argv  main()'s own
/// @return      only on failure. @errors kNotFound: not installed
[[nodiscard]] Result<> start_calibrating(char** argv);

}  // namespace slsd
