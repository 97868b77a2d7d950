// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "programs/calibrate/calibrate_request.hpp"

namespace slsd {

/// The options of `slsd --extrinsics` from its command line, beside the board and its ruler.
struct ExtrinsicsRequest {
  std::filesystem::path file;         ///< output file
  std::vector<std::string> scanners;  ///< "NAME=SOCKET"; the first is the frame of all
  std::string parent = "cell";        ///< the name of that frame
  int places = 3;                     ///< places of the board that two scanners or more see
};

/// Measures where scanners stand to each other by a board that two or more of them see, and writes the file that
/// slsd-dds reads. A client of their services: scans by each in turn, at each line that is read.
/// @errors kInvalidArgument: fewer than two scanners; kNotFound: they do not see the board together; kMismatch: it is
///         not flat, or not of one size; those of the services by their names
[[nodiscard]] Result<> measure_extrinsics(const ExtrinsicsRequest& request, const CalibrateRequest& board);

}  // namespace slsd
