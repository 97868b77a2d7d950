// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/geometry/calibration.hpp"

namespace slsd::dds {

/// The place of a scanner in a cell of several.
struct Extrinsics {
  std::string parent;                  ///< the frame of all
  RigidTransform parent_from_scanner;  ///< millimetres
  std::string calibration_date;        ///< date of the calibration that it was measured with; empty: not known
};

/// A scanner's place in a file of several:
///     parent = "cell"
///     [scanner.left]
///     rotation = [1, 0, 0, 0, 1, 0, 0, 0, 1]     # parent_from_scanner, row by row
///     translation_mm = [0, 0, 0]
///     calibration_date = "2026-01-31T12:00:00Z"  # optional
/// @errors kMalformed: no such file, or no rotation; kNotFound: it does not name the scanner
[[nodiscard]] Result<Extrinsics> read_extrinsics(std::string_view text, const std::string& scanner,
                                                 const std::string& file);

/// The scanners that the file names, by name. @errors kMalformed
[[nodiscard]] Result<std::vector<std::string>> scanners_in(std::string_view text, const std::string& file);

}  // namespace slsd::dds
