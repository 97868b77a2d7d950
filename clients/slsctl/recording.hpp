// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "clients/connection/connection.hpp"
#include "core/result.hpp"
#include "daemon/recording/layout.hpp"

namespace slsd {

/// A folder of frames with all that their clouds depend on, laid out as docs/formats.md says.
/// @thread thread-bound
class Recording {
 public:
  /// Makes the folder, and everything in it but the frames.
  /// @param settings  what `settings` answered
  /// @param clouds    clouds are kept too
  /// @errors kAlreadyExists: the folder is not empty; kPermissionDenied, kNoSpace, kNotFound, kIo
  [[nodiscard]] static Result<Recording> create(const std::filesystem::path& folder, nlohmann::json settings,
                                                bool clouds);

  /// Writes a scan's frames, and its line last. Where that fails none of its frames stay, so that those of several
  /// cameras keep in step.
  /// @param scan  a reply, its cloud as PLY, and its events of frames as raw pixels
  /// @errors kMalformed: frames are missing, or not what they say; kNoSpace, kPermissionDenied, kIo
  [[nodiscard]] Result<> add(const Answered& scan);
  /// Writes that a scan failed. @errors kNoSpace, kIo
  [[nodiscard]] Result<> add_failure(const nlohmann::json& error);
  /// Writes what the recording came to. @errors kNoSpace, kIo
  [[nodiscard]] Result<> finish();

  [[nodiscard]] std::uint64_t scans() const { return scans_; }
  [[nodiscard]] std::uint64_t failures() const { return failures_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  Recording(std::filesystem::path folder, nlohmann::json settings, bool clouds);
  [[nodiscard]] Result<> make_folders() const;
  [[nodiscard]] Result<> write_settings();
  [[nodiscard]] Result<> write_scan(const Answered& scan, nlohmann::json& line);
  void remove_scan() const;
  [[nodiscard]] Result<> write_summary();
  [[nodiscard]] Result<> write(const std::string& name, std::string_view bytes);
  [[nodiscard]] Result<> write_line(const nlohmann::json& line);
  [[nodiscard]] Result<nlohmann::json> write_frame(const RecordedCamera& camera, const Answered& scan);

  std::filesystem::path folder_;
  nlohmann::json settings_;
  bool clouds_;
  std::vector<RecordedCamera> cameras_;
  std::ofstream lines_;
  std::uint64_t scans_ = 0;
  std::uint64_t failures_ = 0;
  std::uint64_t bytes_ = 0;
};

}  // namespace slsd
