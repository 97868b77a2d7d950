// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>

#include "core/result.hpp"

namespace slsd {

/// Becomes slsd-calibrate, with the same command line: a program of its own, so that the service carries none of the
/// libraries that only calibrating needs. It is looked for beside this program, as it is built, then where it is
/// installed.
/// @param argv  as main() was given it
/// @return      only where that fails. @errors kNotFound where it is not installed
[[nodiscard]] Result<> start_calibrating(char** argv);

/// Where slsd-calibrate is; where it will be once it is installed, if it is not.
[[nodiscard]] std::filesystem::path find_calibrator();

}  // namespace slsd
