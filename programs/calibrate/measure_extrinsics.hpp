// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "programs/calibrate/calibrate_request.hpp"

namespace slsd {

/// The options of `slsd --extrinsics` from its command line, except the board and its ruler.
struct ExtrinsicsRequest {
  std::filesystem::path file;         ///< output file
  std::vector<std::string> scanners;  ///< "NAME=SOCKET"; the first one's frame is the common frame
  std::string parent = "cell";        ///< name of the common frame
  int places = 3;                     ///< board placements that at least two scanners see
};

/// Measures the scanners' positions relative to each other with a board that at least two of them see. Writes the file
/// that slsd-dds reads. Is a client of their services: each line read starts a scan by each in turn.
/// @errors kInvalidArgument: fewer than two scanners; kNotFound: no board that connects them was seen; kMismatch: the
///         board is not flat, or its size differs; those of the services, with their names
[[nodiscard]] Result<> measure_extrinsics(const ExtrinsicsRequest& request, const CalibrateRequest& board);

}  // namespace slsd
