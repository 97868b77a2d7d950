// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/geometry/calibration.hpp"
#include "core/result.hpp"

namespace slsd::dds {

/// The position of a scanner in a cell with several.
struct Extrinsics {
  std::string parent;                  ///< the common frame
  RigidTransform parent_from_scanner;  ///< millimetres
  std::string calibration_date;        ///< date of the calibration used in the measurement; empty: unknown
};

/// Reads a scanner's position from a file with several:
///     parent = "cell"
///     [scanner.left]
///     rotation = [1, 0, 0, 0, 1, 0, 0, 0, 1]     # parent_from_scanner, row by row
///     translation_mm = [0, 0, 0]
///     calibration_date = "2026-01-31T12:00:00Z"  # optional
/// @errors kMalformed: an invalid file or rotation; kNotFound: the file does not name the scanner
[[nodiscard]] Result<Extrinsics> read_extrinsics(std::string_view text, const std::string& scanner,
                                                 const std::string& file);

/// The scanners that the file names, by name. @errors kMalformed
[[nodiscard]] Result<std::vector<std::string>> scanners_in(std::string_view text, const std::string& file);

}  // namespace slsd::dds
