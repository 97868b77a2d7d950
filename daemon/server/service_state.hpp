// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include <asio/io_context.hpp>
#include <nlohmann/json.hpp>

#include "daemon/configuration/configuration.hpp"
#include "daemon/scan/scanner.hpp"
#include "daemon/server/calibration_run.hpp"
#include "daemon/server/reply.hpp"
#include "daemon/server/server.hpp"

namespace slsd {

/// The counts of requests so far.
struct RequestCounts {
  std::map<std::string_view, std::uint64_t> by_method;  ///< requests to each method
  std::map<std::string, std::uint64_t> failed;          ///< failed requests, by the error's name
};

/// The number of pictures that one user may still show. It refills over time.
struct PictureAllowance {
  double left;
  std::chrono::steady_clock::time_point since;
};

/// The state that the methods act on. Everything in it outlives the server's sessions.
struct ServiceState {
  asio::io_context& events;
  Scanner& scanner;
  std::filesystem::path configuration_file;
  Configuration configuration;  ///< the one in force; a reload replaces its changeable parts
  std::chrono::steady_clock::time_point started = std::chrono::steady_clock::now();
  Server* server = nullptr;
  std::function<std::uint64_t()> log_lines_dropped = {};
  /// Reads the configuration again, overlays these settings, then answers.
  std::function<void(nlohmann::json settings, Respond)> reload = {};
  /// The number of scans that asked for a preset and are under way; meanwhile no setting changes.
  std::shared_ptr<std::atomic<int>> preset_scans = std::make_shared<std::atomic<int>>(0);
  nlohmann::json settings = nlohmann::json::object();  ///< set over the socket, in the form of merge_settings()
  /// Writes a bundle of the last scans, then answers with its bytes.
  std::function<void(Scanner::Answer<std::string>)> bundle = {};
  std::function<std::uint64_t()> bundles_written = {};  ///< number of bundles that the service wrote on its own
  RequestCounts requests = {};
  std::map<std::uint32_t, PictureAllowance> pictures = {};  ///< by user; full for a user without an entry
  std::filesystem::path calibrator = {};                    ///< slsd-calibrate; empty: not found
  std::unique_ptr<CalibrationRun> calibration = {};
};

}  // namespace slsd
