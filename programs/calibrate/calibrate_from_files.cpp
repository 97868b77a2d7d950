// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/calibrate_from_files.hpp"

#include <algorithm>
#include <chrono>
#include <iostream>
#include <set>

#include <fmt/format.h>

#include "core/printable.hpp"
#include "daemon/configuration/configuration.hpp"
#include "daemon/configuration/settings_over.hpp"
#include "programs/calibrate/board_request.hpp"
#include "programs/calibrate/captures/captured_pattern.hpp"
#include "programs/calibrate/captures/read_captures.hpp"
#include "programs/calibrate/finish_calibration.hpp"

namespace slsd {
namespace {

/// The cameras' names: those of the folders, in the configuration's order if it names them.
std::vector<std::string> camera_names(const std::vector<CapturedPose>& poses, const Configuration& configuration) {
  std::set<std::string> folders;
  for (const CapturedPose& pose : poses) {
    for (const auto& [folder, files] : pose.cameras) folders.insert(folder);
  }
  if (folders == std::set<std::string>{""}) {
    return {configuration.cameras.empty() ? std::string("camera") : configuration.cameras.front().name()};
  }
  std::vector<std::string> names;
  for (const CameraOptions& camera : configuration.cameras) {
    if (folders.erase(camera.name()) > 0) names.push_back(camera.name());
  }
  folders.erase("");
  names.insert(names.end(), folders.begin(), folders.end());
  return names;
}

/// Several cameras must all have pictures: slsd starts only with a calibration of them all.
Result<> check_cameras(const CalibrateRequest& request, const std::vector<std::string>& names,
                       const Configuration& configuration) {
  if (!request.output.empty() || configuration.cameras.size() < 2) return {};
  for (const CameraOptions& camera : configuration.cameras) {
    if (std::ranges::find(names, camera.name()) != names.end()) continue;
    return fail(ErrorCode::kMismatch,
                fmt::format("has no pictures of camera \"{}\", and slsd starts only if the calibration has every "
                            "configured camera: take poses with all cameras, remove its [[camera]] table, or write the "
                            "calibration elsewhere with --output",
                            printable(camera.name(), 64)),
                request.from.string());
  }
  return {};
}

ImageSize projector_of(const Pattern& pattern, const Configuration& configuration, bool gray_code) {
  if (gray_code) return {configuration.projector.width_px, configuration.projector.height_px};
  return {pattern.options.projector_width_px, pattern.options.projector_height_px};
}

std::string refusals(const std::vector<PoseReport>& refused) {
  std::string text;
  for (const PoseReport& pose : refused) text += fmt::format("\n  {}: {}", pose.name, pose.reason);
  return text;
}

/// Keeps the poses from one name to another, and all views of the reference plane.
Result<> keep_part(const std::string& use, std::vector<CapturedPose>& poses) {
  const std::size_t colon = use.find(':');
  const std::string first = use.substr(0, colon), last = colon == use.npos ? first : use.substr(colon + 1);
  for (const std::string& name : {first, last}) {
    if (std::ranges::find(poses, name, &CapturedPose::name) != poses.end()) continue;
    return fail(ErrorCode::kInvalidArgument,
                "matches no pose: write FIRST:LAST, such as " + poses.front().name + ":" + poses.back().name,
                "--use " + use);
  }
  std::erase_if(poses, [&](const CapturedPose& pose) {
    return pose.subject == PoseSubject::kBoard && (pose.name < first || pose.name > last);
  });
  return {};
}

Result<std::vector<CapturedPose>> list_all(const std::filesystem::path& folder, bool knows_plane) {
  auto poses = list_captures_with_planes(folder, knows_plane);
  if (!poses || !knows_plane || poses->back().subject == PoseSubject::kPlane) return poses;
  return fail(ErrorCode::kNotFound,
              "has no view of the reference plane for --plane: add plane_NN/white.png and plane_NN/pattern.png",
              folder.string());
}

}  // namespace

Result<> calibrate_from_files(const CalibrateRequest& request) {
  const auto begin = std::chrono::steady_clock::now();
  const auto configuration = load_configuration_in_force(request.configuration_file, std::cout);
  if (!configuration) return tl::unexpected(configuration.error());
  const auto board = requested_board(request);
  if (!board) return tl::unexpected(board.error());
  const auto plane = requested_plane(request);
  if (!plane) return tl::unexpected(plane.error());
  const auto file = file_to_keep(request, *configuration);
  if (!file) return tl::unexpected(file.error());
  auto poses = list_all(request.from, plane->has_value());
  if (!poses) return tl::unexpected(poses.error());
  if (!request.use.empty()) {
    if (auto kept = keep_part(request.use, *poses); !kept) return kept;
  }
  const std::vector<std::string> names = camera_names(*poses, *configuration);
  if (auto all = check_cameras(request, names, *configuration); !all) return all;
  const auto pattern = captured_pattern(request.from, *configuration);
  if (!pattern) return tl::unexpected(pattern.error());

  const bool gray_code = request.gray_code || captured_in_gray(*poses);
  const ImageSize projector = projector_of(*pattern, *configuration, gray_code);
  std::cout << fmt::format("board {}{}, projector {}x{}, {} poses\n", to_string(*board),
                           *plane ? ", reference plane " + to_string(**plane) : "", projector.width_px,
                           projector.height_px, poses->size());
  PoseObservers observers = make_observers(*board, *plane, *pattern, projector, gray_code);
  auto captures = read_captures(*poses, names, projector, gray_code, observers,
                                [](const std::string& line) { std::cout << line << std::endl; });
  if (!captures) return tl::unexpected(captures.error());
  if (captures->observations.count(PoseSubject::kBoard) == 0) {
    return tl::unexpected(refused(
        *file, {ErrorCode::kNotFound, "no pose is usable:" + refusals(captures->refused), request.from.string()},
        captures->refused));
  }
  const Board& found = observers.board.board();
  if (!(found == *board))
    std::cout << fmt::format("the board is {}: --board had its columns and rows swapped\n", to_string(found));
  auto outcome = calibrate(std::move(captures->observations), calibrate_options(*configuration, found));
  if (!outcome) return tl::unexpected(refused(*file, outcome.error(), captures->refused));
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin;
  std::cout << fmt::format("calibrated in {:.1f} s, {:.2f} s per pose\n", spent.count(),
                           spent.count() / static_cast<double>(poses->size()));
  return finish_calibration(request, *file, *file, found, captures->refused, std::move(*outcome));
}

}  // namespace slsd
