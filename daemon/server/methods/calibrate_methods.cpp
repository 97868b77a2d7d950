// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <filesystem>
#include <string>
#include <vector>

#include "daemon/configuration/settings_over.hpp"
#include "daemon/server/methods/answer.hpp"
#include "daemon/server/methods/methods.hpp"
#include "rpc/param_reader.hpp"

namespace slsd {
namespace {

using nlohmann::json;

// The folder of the calibrations made over the socket, beside the settings.
std::filesystem::path made_calibration(const ServiceState& state) {
  const auto settings = kept_settings_file(state.configuration_file);
  if (settings.empty()) return {};
  return settings.parent_path() / ("calibration-" + state.configuration_file.stem().string() + ".yml");
}

Result<> begin_calibration(ServiceState& state, const std::vector<std::string>& wanted, bool resume) {
  const auto file = made_calibration(state);
  if (file.empty())
    return fail(
        ErrorCode::kNotFound,
        "$STATE_DIRECTORY is not set, so a calibration cannot be kept: start the service with its systemd unit");
  if (state.calibration->under_way())
    return fail(ErrorCode::kBusy, "a calibration is under way: end or cancel it first");
  const auto poses = std::filesystem::path(file).replace_extension(".poses");
  std::error_code ignored;
  if (!resume) std::filesystem::remove_all(poses, ignored);
  std::vector<std::string> arguments{"--calibrate",
                                     "--progress",
                                     "--config=" + state.configuration_file.string(),
                                     "--socket=" + state.configuration.server.socket.string(),
                                     "--output=" + file.string(),
                                     "--record=" + poses.string()};
  arguments.insert(arguments.end(), wanted.begin(), wanted.end());
  auto begun = state.calibration->begin(state.calibrator, arguments);
  if (begun) state.scanner.run_freely(std::nullopt);
  return begun;
}

}  // namespace

void run_calibrate(ServiceState& state, const json& params, Session&, Respond respond) {
  ParamReader reader(params);
  const std::string action = reader.choice("action", {"look", "begin", "end", "cancel"});
  const std::string board = reader.text("board"), ruler = reader.text("ruler");
  const std::string code = reader.choice("code", {"pattern", "gray"});
  const int poses = reader.integer("poses", 12, 3, 99);
  const bool resume = reader.boolean("resume", false);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  if (action == "begin") {
    std::vector<std::string> wanted{"--poses=" + std::to_string(poses), "--code=" + code};
    if (!board.empty()) wanted.push_back("--board=" + board);
    if (!ruler.empty()) wanted.push_back("--ruler=" + ruler);
    if (auto begun = begin_calibration(state, wanted, resume); !begun)
      return respond(tl::unexpected(rpc_error(begun.error())));
  }
  if (action == "end") state.calibration->end();
  if (action == "cancel") state.calibration->cancel();
  respond(Reply{state.calibration->look()});
}

void calibrated(ServiceState& state, bool made) {
  const auto release = [&state] {
    const MonotonicTime deadline = deadline_in(state.configuration.scan.timeout_ms);
    state.scanner.project({Picture::kIdle, {}, deadline, {}}, [](const auto&) {});
    state.server->update_demand();
  };
  if (!made) return release();
  const auto conclude = [&state, release](const Outcome& outcome) {
    state.calibration->conclude(
        outcome ? Result<>()
                : fail(ErrorCode::kIo, "the calibration is saved but not in force: " + outcome.error().message));
    release();
  };
  auto settings = merge_settings(state.settings, {{"calibration", {{"file", made_calibration(state).string()}}}});
  if (settings) return state.reload(std::move(*settings), conclude);
  conclude(tl::unexpected(rpc_error(settings.error())));
}

}  // namespace slsd
