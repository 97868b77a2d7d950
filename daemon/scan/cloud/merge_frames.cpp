// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/cloud/merge_frames.hpp"

#include <utility>

#include "core/exposure/merge_exposures.hpp"

namespace slsd {
namespace {

MergedCamera merge_camera(std::size_t camera, const ScanSetup& setup, FrameSet& set) {
  std::vector<std::pair<Frame*, std::optional<Frame>*>> taken;
  std::vector<ExposurePair> pairs;
  std::vector<GreyView> all;
  for (const auto& [shorter, longer] : {std::pair(&set.frames, &set.longer), std::pair(&set.white, &set.longer_white),
                                        std::pair(&set.dark, &set.longer_dark)}) {
    if (shorter->empty()) continue;
    taken.emplace_back(&(*shorter)[camera], &(*longer)[camera]);
    pairs.push_back({taken.back().first->image(), (*taken.back().second)->image()});
    all.insert(all.end(), {pairs.back().shorter, pairs.back().longer});
  }
  MergedPictures merged = merge_pictures(pairs, setup.full_level_of(camera, all), set.exposure_ratios[camera]);
  for (std::size_t i = 0; i < taken.size(); ++i) {
    const auto& [frame, longer] = taken[i];
    set.merged.push_back(std::move(merged.images[i]));
    *frame = Frame(set.merged.back().view(), frame->sequence(), frame->exposure_start(), (*longer)->received())
                 .with_colours(frame->reader_of_colours());
    longer->reset();
  }
  return {setup.camera_names[camera], std::move(merged.problem)};
}

}  // namespace

std::vector<MergedCamera> merge_frames(FrameSet& set, const ScanSetup& setup) {
  std::vector<MergedCamera> outcomes;
  for (std::size_t camera = 0; camera < set.longer.size(); ++camera) {
    if (set.longer[camera]) outcomes.push_back(merge_camera(camera, setup, set));
  }
  return outcomes;
}

}  // namespace slsd
