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
#include "drivers/recording/layout.hpp"

namespace slsd {

/// A folder of frames with everything that their clouds depend on, in the layout of docs/formats.md.
/// @thread thread-bound
class Recording {
 public:
  /// Creates the folder, and everything in it except the frames.
  /// @param settings  the answer to `settings`
  /// @param clouds    also keep the clouds
  /// @errors kAlreadyExists: the folder is not empty; kPermissionDenied, kNoSpace, kNotFound, kIo
  [[nodiscard]] static Result<Recording> create(const std::filesystem::path& folder, nlohmann::json settings,
                                                bool clouds);

  /// Writes a scan's frames, and its line last. On an error none of its frames remain, so that several cameras stay in
  /// step.
  /// @param scan  a reply with its cloud as PLY, and the events with its frames as raw pixels
  /// @errors kMalformed: frames are missing or inconsistent; kNoSpace, kPermissionDenied, kIo
  [[nodiscard]] Result<> add(const Answered& scan);
  /// Writes that a scan failed. @errors kNoSpace, kIo
  [[nodiscard]] Result<> add_failure(const nlohmann::json& error);
  /// Writes the recording's summary. @errors kNoSpace, kIo
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
