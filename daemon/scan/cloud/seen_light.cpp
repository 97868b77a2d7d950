// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/cloud/seen_light.hpp"

#include <utility>
#include <vector>

#include "core/exposure/merge_exposures.hpp"

namespace slsd {
namespace {

// The saturation level of a camera, for all its frames.
double full_level_of(const FrameSet& set, const ScanSetup& setup, std::size_t camera) {
  if (set.is_merged(camera)) return kMergedFull;
  std::vector<GreyView> all;
  for (const auto* frames : {&set.frames, &set.white, &set.dark}) {
    if (camera < frames->size()) all.push_back((*frames)[camera].image());
  }
  return setup.full_level_of(camera, all);
}

Result<> add_colours(const FrameSet& set, const ScanSetup& setup, std::size_t camera, SeenLight& seen) {
  const auto read = [camera](const std::vector<Frame>& frames, ColourFrame& colours) -> Result<> {
    if (camera >= frames.size()) return {};
    auto converted = frames[camera].colours();
    if (!converted) return tl::unexpected(std::move(converted.error()));
    colours = std::move(*converted);
    if (colours.empty() || size_of(frames[camera].image()) == std::pair(colours.width(), colours.height())) return {};
    return fail(ErrorCode::kMismatch, "a frame and its colours differ in size: scan again");
  };
  auto added = read(set.white, seen.white);
  if (added) added = read(set.dark, seen.dark);
  if (!added && added.error().where.empty()) added.error().where = "camera " + setup.camera_names[camera];
  if (!added || seen.white.empty()) return added;
  seen.light.white_colours = &seen.white;
  if (!seen.dark.empty()) seen.light.dark_colours = &seen.dark;
  if (camera < setup.colour_gains.size()) seen.light.gains = setup.colour_gains[camera];
  seen.light.colour_full = set.is_merged(camera) ? setup.full_level_of(camera, {}) : seen.light.full;
  return added;
}

}  // namespace

// The object must not move, because the light refers to its colours.
Result<> read_light(const FrameSet& set, const ScanSetup& setup, std::size_t camera, bool coloured, SeenLight& seen) {
  if (camera < set.white.size()) seen.light.white = set.white[camera].image();
  if (camera < set.dark.size()) seen.light.dark = set.dark[camera].image();
  seen.light.full = full_level_of(set, setup, camera);
  return coloured ? add_colours(set, setup, camera, seen) : Result<>();
}

}  // namespace slsd
