// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/cloud/merge_frames.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "core/exposure/light_levels.hpp"
#include "core/exposure/merge_exposures.hpp"

namespace slsd {
namespace {

/// The two exposures of one picture, by camera.
struct Exposures {
  std::vector<Frame>& shorter;
  LongerFrames& longer;
};

double full_level_of(const std::array<Exposures, 3>& pictures, const ScanSetup& setup, std::size_t camera) {
  const std::string format = camera < setup.camera_formats.size() ? setup.camera_formats[camera] : "";
  double full = 0;
  for (const auto& [shorter, longer] : pictures) {
    if (shorter.empty()) continue;
    full = std::max({full, full_level(format, shorter[camera].image()), full_level(format, longer[camera]->image())});
  }
  return setup.full_levels->raise(camera, full);
}

MergedCamera merge_camera(const std::array<Exposures, 3>& pictures, const ScanSetup& setup, std::size_t camera,
                          FrameSet& set) {
  MergedCamera outcome{setup.camera_names[camera], {}};
  const double full = full_level_of(pictures, setup, camera);
  std::array<std::optional<Grey16>, 3> merged;
  for (std::size_t i = 0; i < pictures.size() && outcome.problem.empty(); ++i) {
    const auto& [shorter, longer] = pictures[i];
    if (shorter.empty()) continue;
    auto both = merge_exposures(shorter[camera].image(), longer[camera]->image(), full, set.exposure_ratios[camera]);
    if (both) {
      merged[i] = std::move(both->image);
    } else {
      outcome.problem = both.error().message;
    }
  }
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const auto& [shorter, longer] = pictures[i];
    if (shorter.empty()) continue;
    Frame& frame = shorter[camera];
    set.merged.push_back(outcome.problem.empty() ? std::move(*merged[i]) : as_merged(frame.image(), full));
    frame = Frame(set.merged.back().view(), frame.sequence(), frame.exposure_start(), longer[camera]->received());
    longer[camera].reset();
  }
  return outcome;
}

}  // namespace

std::vector<MergedCamera> merge_frames(FrameSet& set, const ScanSetup& setup) {
  const std::array<Exposures, 3> pictures{
      {{set.frames, set.longer}, {set.white, set.longer_white}, {set.dark, set.longer_dark}}};
  std::vector<MergedCamera> outcomes;
  for (std::size_t camera = 0; camera < set.longer.size(); ++camera) {
    if (set.longer[camera]) outcomes.push_back(merge_camera(pictures, setup, camera, set));
  }
  return outcomes;
}

}  // namespace slsd
