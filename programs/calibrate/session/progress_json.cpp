// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/session/progress_json.hpp"

#include <algorithm>
#include <cmath>

#include "core/calibrate/judge/coverage.hpp"

namespace slsd {
namespace {

using nlohmann::json;

constexpr std::size_t kPointsMax = 60;  // drawn points of a board

json coverage_json(const Coverage& coverage) {
  return {{"columns", kCoverageColumns}, {"rows", kCoverageRows}, {"counts", coverage.counts}};
}

json points_json(const BoardSighting& sighting) {
  json points = json::array();
  const std::size_t step = std::max<std::size_t>(1, sighting.points.size() / kPointsMax);
  for (std::size_t i = 0; i < sighting.points.size(); i += step) {
    const auto& pixel = sighting.points[i].pixel;
    points.push_back({std::round(pixel.x()), std::round(pixel.y())});
  }
  return points;
}

}  // namespace

json progress_json(const PoseProgress& progress) {
  const Observations& seen = progress.poses.observations();
  json cameras = json::array();
  for (std::size_t i = 0; i < seen.cameras.size(); ++i) {
    const NamedCamera& camera = seen.cameras[i];
    json told{{"name", camera.name},
              {"width_px", camera.size.width_px},
              {"height_px", camera.size.height_px},
              {"coverage", coverage_json(camera_coverage(seen, i))},
              {"points", json::array()}};
    if (i < progress.sightings.size() && progress.sightings[i]) told["points"] = points_json(*progress.sightings[i]);
    if (i < progress.sightings.size() && !progress.sightings[i]) told["unseen"] = progress.sightings[i].error().message;
    cameras.push_back(std::move(told));
  }
  return {{"state", progress.state},
          {"text", progress.text},
          {"poses", progress.poses.size()},
          {"wanted", progress.wanted},
          {"subject", progress.poses.subject() == PoseSubject::kBoard ? "board" : "plane"},
          {"next", progress.poses.most_helpful()},
          {"cameras", std::move(cameras)},
          {"projector", {{"coverage", coverage_json(projector_coverage(seen))}}}};
}

json outcome_json(const CalibrationOutcome& outcome) {
  return {{"grade", to_string(outcome.verdict.grade)}, {"reasons", outcome.verdict.reasons},
          {"advice", outcome.verdict.advice},          {"warnings", outcome.warnings},
          {"camera_rms_px", outcome.camera_rms_px},    {"projector_rms_px", outcome.projector_rms_px},
          {"epipolar_rms_px", outcome.epipolar_rms_px}};
}

}  // namespace slsd
