// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include <asio/io_context.hpp>

#include "daemon/configuration/configuration.hpp"
#include "daemon/rpc/request.hpp"
#include "daemon/scan/scanner.hpp"
#include "daemon/server/calibration_run.hpp"
#include "daemon/server/reply.hpp"
#include "daemon/server/server.hpp"

namespace slsd {

/// What was asked for so far.
struct RequestCounts {
  std::map<std::string_view, std::uint64_t> by_method;
  std::map<std::string, std::uint64_t> failed;  ///< by the error's name
};

/// How many pictures one user may have shown at a time, which fills up again as time goes by.
struct PictureAllowance {
  double left;
  std::chrono::steady_clock::time_point since;
};

/// What the methods act on. Everything outlives the server's sessions.
struct ServiceState {
  asio::io_context& events;
  Scanner& scanner;
  std::filesystem::path configuration_file;
  Configuration configuration;  ///< in force; a reload replaces what it may
  std::chrono::steady_clock::time_point started = std::chrono::steady_clock::now();
  Server* server = nullptr;
  std::function<std::uint64_t()> log_lines_dropped = {};
  /// Reads the configuration anew, with these settings over it, then answers.
  std::function<void(nlohmann::json settings, Respond)> reload = {};
  nlohmann::json settings = nlohmann::json::object();  ///< set over the socket, as merge_settings() has them
  /// Writes a bundle of the last scans, then answers with its bytes.
  std::function<void(Scanner::Answer<std::string>)> bundle = {};
  std::function<std::uint64_t()> bundles_written = {};  ///< by itself
  RequestCounts requests = {};
  std::map<std::uint32_t, PictureAllowance> pictures = {};  ///< by user; who is not in it has all
  std::filesystem::path calibrator = {};                    ///< slsd-calibrate; empty: not found
  std::unique_ptr<CalibrationRun> calibration = {};
};

/// One method of the socket's protocol.
struct RpcMethod {
  std::string_view name;
  Role role;  ///< that it takes
  void (*run)(ServiceState& state, const nlohmann::json& params, Session& session, Respond respond);
};

/// All methods, by name.
[[nodiscard]] std::span<const RpcMethod> methods();

/// What follows when slsd-calibrate has ended: what it made comes into force as `set` does it, and scans go on.
void calibrated(ServiceState& state, bool made);

/// Carries a request out. @thread thread-bound to the event loop's
void dispatch(ServiceState& state, const Request& request, Session& session, Respond respond);

}  // namespace slsd
