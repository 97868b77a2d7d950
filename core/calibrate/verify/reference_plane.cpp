// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/verify/reference_plane.hpp"

#include <utility>

namespace slsd {
namespace {

std::optional<ViewCheck> check(const PoseView& view, const Calibration& calibration) {
  const auto checked = check_view(view, calibration.cameras[view.camera], calibration.projector);
  return checked ? std::optional(*checked) : std::nullopt;
}

}  // namespace

std::vector<PlaneCheck> check_planes(const Observations& observations, const Calibration& calibration) {
  std::vector<PlaneCheck> checks;
  for (const PoseObservation& pose : observations.poses) {
    if (pose.subject != PoseSubject::kPlane) continue;
    for (const PoseView& view : pose.views) {
      checks.push_back({pose.name, observations.cameras[view.camera].name, check(view, calibration), std::nullopt});
    }
  }
  return checks;
}

void check_again(const Observations& observations, const Calibration& calibration, std::vector<PlaneCheck>& checks) {
  for (PlaneCheck& now : check_planes(observations, calibration)) {
    for (PlaneCheck& check : checks) {
      if (check.name == now.name && check.camera == now.camera) check.after = std::move(now.before);
    }
  }
}

VerifySummary summarise(const std::vector<PlaneCheck>& checks, std::optional<ViewCheck> PlaneCheck::*when) {
  std::vector<ViewCheck> measured;
  for (const PlaneCheck& check : checks) {
    if (check.*when) measured.push_back(*(check.*when));
  }
  return summarise(measured, {});
}

}  // namespace slsd
