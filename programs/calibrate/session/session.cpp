// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/session/session.hpp"

#include <algorithm>
#include <chrono>
#include <iostream>
#include <iterator>
#include <optional>
#include <sstream>

#include <fmt/format.h>

#include "core/calibrate/observe/gray_code.hpp"
#include "daemon/configuration/settings_over.hpp"
#include "daemon/scan/rig/hardware.hpp"
#include "drivers/system/interrupt.hpp"
#include "programs/calibrate/board_request.hpp"
#include "programs/calibrate/finish_calibration.hpp"
#include "programs/calibrate/session/device_source.hpp"
#include "programs/calibrate/session/pose_session.hpp"
#include "programs/calibrate/session/progress_json.hpp"
#include "programs/calibrate/session/session_record.hpp"
#include "programs/calibrate/session/socket_source.hpp"

namespace slsd {
namespace {

using std::filesystem::path;

constexpr int kPosesMin = 3, kPosesMax = 99, kPlanesMin = 1;

/// The decisions made before a device is opened.
struct Preparation {
  Configuration configuration;
  Board board;
  std::optional<Board> plane;
  path file;    // file of the calibration
  path folder;  // folder of the pictures
  Pattern pattern;
  path in_force;                         // the calibration that a worse one must not replace; empty: none
  std::unique_ptr<SocketSource> source;  // the devices of a running service, if it has them
};

Result<Preparation> prepare(const CalibrateRequest& request) {
  if (request.poses < kPosesMin || request.poses > kPosesMax) {
    return fail(ErrorCode::kInvalidArgument, fmt::format("must be {} to {}", kPosesMin, kPosesMax), "--poses");
  }
  if (request.planes < kPlanesMin || request.planes > kPosesMax) {
    return fail(ErrorCode::kInvalidArgument, fmt::format("must be {} to {}", kPlanesMin, kPosesMax), "--planes");
  }
  std::ostringstream unused_notes;  // dropped: a running service reports its settings itself
  auto configuration =
      load_configuration_in_force(request.configuration_file, request.socket.empty() ? std::cout : unused_notes);
  if (!configuration) return tl::unexpected(configuration.error());
  auto board = requested_board(request);
  if (!board) return tl::unexpected(board.error());
  auto plane = requested_plane(request);
  if (!plane) return tl::unexpected(plane.error());
  auto file = file_to_keep(request, *configuration);
  if (!file) return tl::unexpected(file.error());
  path folder = record_folder(request, *file);
  path in_force = *file;
  std::unique_ptr<SocketSource> source;
  if (!request.socket.empty()) {
    auto connected = SocketSource::create(request.socket);
    if (!connected) return tl::unexpected(connected.error());
    source = std::move(*connected);
    in_force = source->calibration();
    configuration->projector.width_px = source->projector().width_px;
    configuration->projector.height_px = source->projector().height_px;
  }
  auto pattern = source && !holds_poses(folder) ? read_pattern(source->pattern(), request.socket.string())
                                                : session_pattern(folder, *configuration);
  if (!pattern) return tl::unexpected(pattern.error());
  return Preparation{
      std::move(*configuration), *board,           *plane, std::move(*file), std::move(folder), std::move(*pattern),
      std::move(in_force),       std::move(source)};
}

std::string resume_text(const path& folder, std::size_t poses) {
  if (poses == 0) return "no pose was taken";
  return fmt::format("the {} poses taken are kept; continue them with --record {}", poses, folder.string());
}

void print(const std::string& line) {
  std::cout << line << std::endl;
}

void print(const nlohmann::json& told) {
  print(told.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace));
}

/// @param begun  the devices have already given pictures
Result<> take_poses(const CalibrateRequest& request, const Preparation& prepared, PoseSource& source,
                    PoseObserver& observer, PoseRecorder& recorder, PoseCollection& poses, bool begun) {
  if (Interrupt::came()) return {};
  PoseTaker taker(source, observer,
                  request.gray_code ? draw_gray_code(source.projector()) : std::vector{draw_pattern(prepared.pattern)},
                  request.gray_code);
  const Timepiece time;
  SessionTerminal terminal(
      std::cout, request.progress ? SessionTerminal::kNoLive : SessionTerminal::columns_of_stdout(), time.now);
  PoseSessionOptions options;
  options.poses = static_cast<std::size_t>(poses.subject() == PoseSubject::kBoard ? request.poses : request.planes);
  options.begun = begun;
  PoseSessionParts parts{source, taker, recorder, poses, terminal, time, Interrupt::came};
  if (request.progress) parts.progress = [](const PoseProgress& progress) { print(progress_json(progress)); };
  return PoseSession(std::move(parts), options).run();
}

/// Takes the poses, then the views of the reference plane; includes those recorded earlier.
Result<Observations> take_all(const CalibrateRequest& request, const Preparation& prepared, PoseSource& source,
                              PoseObservers& observers, PoseRecorder& recorder, const Observations& recorded) {
  PoseCollection poses(prepared.board, recorded);
  auto taken = take_poses(request, prepared, source, observers.board, recorder, poses, false);
  Observations observations = poses.observations();
  if (taken && prepared.plane) {
    Observations so_far = recorded;
    so_far.cameras = observations.cameras;
    PoseCollection planes(*prepared.plane, so_far, PoseSubject::kPlane);
    const bool begun = poses.size() > recorded.count(PoseSubject::kBoard);
    taken = take_poses(request, prepared, source, *observers.plane, recorder, planes, begun);
    std::ranges::copy(planes.observations().poses, std::back_inserter(observations.poses));
  }
  if (taken) return observations;
  Error error = taken.error();
  if (!observations.poses.empty()) error.message += "; " + resume_text(recorder.folder(), observations.poses.size());
  return tl::unexpected(std::move(error));
}

Result<> calibrate_from(const CalibrateRequest& request, const Preparation& prepared, const Observations& observations,
                        const std::vector<PoseReport>& refused, const RigStatus& rig) {
  const std::size_t poses = observations.count(PoseSubject::kBoard);
  if (request.progress) print(nlohmann::json{{"state", "computing"}});
  if (poses < static_cast<std::size_t>(kPosesMin)) {
    return fail(ErrorCode::kCancelled, fmt::format("ended with {} poses, but at least {} are needed; {}", poses,
                                                   kPosesMin, resume_text(prepared.folder, poses)));
  }
  const auto begin = std::chrono::steady_clock::now();
  auto outcome = calibrate(observations, calibrate_options(prepared.configuration, prepared.board));
  if (!outcome) {
    Error error = outcome.error();
    error.message += "; " + resume_text(prepared.folder, poses);
    return tl::unexpected(slsd::refused(prepared.file, std::move(error), refused));
  }
  print(fmt::format("calibrated in {:.1f} s from {} poses, recorded in {}",
                    std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(), poses,
                    prepared.folder.string()));
  note_hardware(rig, outcome->calibration);
  if (request.progress) print(nlohmann::json{{"outcome", outcome_json(*outcome)}});
  return finish_calibration(request, prepared.file, prepared.in_force, prepared.board, refused, std::move(*outcome));
}

}  // namespace

Result<> calibrate_by_session(const CalibrateRequest& request) {
  const auto prepared = prepare(request);
  if (!prepared) return tl::unexpected(prepared.error());
  std::unique_ptr<DeviceSource> devices;
  if (!prepared->source) {
    auto made = DeviceSource::create(prepared->configuration);
    if (!made) return tl::unexpected(made.error());
    devices = std::move(*made);
  }
  PoseSource& source = devices ? static_cast<PoseSource&>(*devices) : *prepared->source;
  const ImageSize projector = source.projector();
  Interrupt::watch();
  print(fmt::format("board {}{}, projector {}x{}, pictures in {}; Ctrl-C ends the session with the poses taken",
                    to_string(prepared->board),
                    prepared->plane ? ", reference plane " + to_string(*prepared->plane) : "", projector.width_px,
                    projector.height_px, prepared->folder.string()));
  PoseObservers observers =
      make_observers(prepared->board, prepared->plane, prepared->pattern, projector, request.gray_code);
  auto record = read_record(prepared->folder, source.cameras(), projector, request.gray_code, observers,
                            [](const std::string& line) { print(line); });
  if (!record) return tl::unexpected(record.error());
  auto recorder = PoseRecorder::create(prepared->folder, source.cameras(), prepared->pattern);
  if (!recorder) return tl::unexpected(recorder.error());
  const auto observations = take_all(request, *prepared, source, observers, *recorder, record->observations);
  if (!observations) return tl::unexpected(observations.error());
  const RigStatus rig = devices ? devices->status() : prepared->source->status();
  devices.reset();
  return calibrate_from(request, *prepared, *observations, record->refused, rig);
}

}  // namespace slsd
