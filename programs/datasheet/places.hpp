// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "clients/connection/connection.hpp"
#include "core/cloud/read_dense_ply.hpp"
#include "core/result.hpp"

namespace slsd {

enum class Artefact { kPlate, kSphere, kBar };

/// "plate", as in the names of files.
[[nodiscard]] std::string to_string(Artefact artefact);

/// "plate-03.ply". @param number  from 1
[[nodiscard]] std::string cloud_name(Artefact artefact, int number);

/// The artefact's clouds in a folder, by number; none if there is no folder.
/// @errors kIo: the folder cannot be read
[[nodiscard]] Result<std::map<int, std::filesystem::path>> clouds_in(const std::filesystem::path& folder,
                                                                     Artefact artefact);

/// @errors of the file; kMalformed and kUnsupported: it is no dense cloud
[[nodiscard]] Result<std::vector<DensePoint>> read_place(const std::filesystem::path& file);

/// Takes dense scans from a running service.
class PlaceScanner {
 public:
  /// @errors kNotFound: no service answers
  [[nodiscard]] static Result<PlaceScanner> open(const std::filesystem::path& socket);
  /// @return a dense cloud as PLY
  /// @errors kIo: the service refused
  [[nodiscard]] Result<std::string> scan();

 private:
  explicit PlaceScanner(Connection connection) : connection_(std::move(connection)) {}
  Connection connection_;
};

}  // namespace slsd
