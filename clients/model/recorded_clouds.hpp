// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "core/geometry/calibration.hpp"
#include "core/result.hpp"

namespace slsd::model {

/// The clouds of a recording, in the order of their scans.
struct RecordedClouds {
  Calibration calibration;
  std::filesystem::path folder;
  std::vector<std::string> names;  ///< "clouds/00000000.ply", below the folder
  std::size_t failed = 0;          ///< scans that gave no cloud
  std::vector<std::string> warnings;
};

/// Reads what `slsctl record DIR --clouds` wrote: docs/formats.md, recordings. A recording that ends early is used as
/// far as it goes, with a warning.
/// @errors kNotFound, kMalformed, kPermissionDenied, kIo
[[nodiscard]] Result<RecordedClouds> read_recording(const std::filesystem::path& folder);

/// Reads one of the clouds. @errors as read_file()
[[nodiscard]] Result<std::string> read_recorded(const RecordedClouds& recorded, const std::string& name);

}  // namespace slsd::model
