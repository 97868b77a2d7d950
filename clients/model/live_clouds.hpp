// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>

#include "clients/connection/connection.hpp"
#include "core/geometry/calibration.hpp"
#include "core/result.hpp"

namespace slsd::model {

/// Dense clouds of a running service. Keeps them in a folder, in the layout of a recording: docs/formats.md.
/// @thread thread-bound
class LiveClouds {
 public:
  /// @param folder  new or empty; nothing: a temporary one, which ends with this object
  /// @errors kNotFound: no service, or it has no calibration; kAlreadyExists: the folder is not empty; as Connection
  [[nodiscard]] static Result<LiveClouds> open(const std::filesystem::path& socket,
                                               const std::optional<std::filesystem::path>& folder);
  LiveClouds(LiveClouds&&) noexcept = default;
  LiveClouds& operator=(LiveClouds&&) = delete;
  ~LiveClouds();

  [[nodiscard]] const Calibration& calibration() const { return calibration_; }

  /// Makes the next clouds coloured: the object must then stand still for two frames.
  void want_colour() { colour_ = true; }
  /// Asks for a cloud. The service takes it while the caller works on the one before. @errors as Connection::request()
  [[nodiscard]] Result<> request();
  /// Waits for the cloud that was asked for.
  /// @return  the PLY, or nothing if the scan failed for a reason that may pass: then problem() says why
  /// @errors  as Connection; of the scan
  [[nodiscard]] Result<std::optional<std::string>> receive();
  [[nodiscard]] const std::string& problem() const { return problem_; }

  /// Writes a cloud into the folder. @return its name @errors kNoSpace, kPermissionDenied, kIo
  [[nodiscard]] Result<std::string> keep(std::string_view ply);
  /// Reads a cloud that was kept. @errors as read_file()
  [[nodiscard]] Result<std::string> read(const std::string& name) const;
  /// Completes the folder as a recording. @errors as keep()
  [[nodiscard]] Result<> finish();

  /// Gives the room of temporary clouds on a full disk to a file. Removes them only if the file then fits.
  /// @return whether they were removed
  [[nodiscard]] bool make_room(const std::filesystem::path& file, std::uintmax_t bytes);
  /// Keeps the folder, also a temporary one. @return it; empty: its clouds are removed
  [[nodiscard]] std::filesystem::path keep_folder();

 private:
  LiveClouds(Connection connection, Calibration calibration, std::filesystem::path folder, bool temporary);

  Connection connection_;
  Calibration calibration_;
  std::filesystem::path folder_;
  bool temporary_;
  bool colour_ = false;
  std::ofstream lines_;
  std::size_t kept_ = 0;
  std::string problem_;
};

}  // namespace slsd::model
