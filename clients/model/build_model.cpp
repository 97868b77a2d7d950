// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/build_model.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "clients/model/read_cloud.hpp"
#include "clients/model/tidy_mesh.hpp"
#include "clients/model/track.hpp"
#include "clients/model/volume.hpp"
#include "core/geometry/robust.hpp"
#include "drivers/files/file.hpp"

namespace slsd::model {
namespace {

constexpr std::size_t kCloudLimitBytes = std::size_t{1} << 31;
/// A frame whose surface lies so many sigma off the others', usually, was wrongly tracked.
constexpr double kGreatestFitAdjusted = 2.5;
/// Smaller pieces of surface, as a share of it, are taken for stray points.
constexpr double kSmallestPiece = 0.001;

Result<Shot> read_shot(const RecordedClouds& recorded, const std::string& name, const ModelOptions& options) {
  const auto bytes = read_file(recorded.folder / name, kCloudLimitBytes);
  if (!bytes) return tl::unexpected(bytes.error());
  const auto points = read_cloud(*bytes);
  if (!points) return tl::unexpected(points.error());
  auto images = range_images(*points, recorded.calibration, options.box);
  if (!images) return tl::unexpected(images.error());
  return make_shot(std::move(*images));
}

/// Voxels as wide as a pixel sees, or as the usual sigma, if that is more.
float voxel_for(const Shot& shot) {
  std::vector<float> sizes, sigmas;
  for (const SurfaceView& view : shot.views) {
    for (std::size_t i = 0; i < view.image.depth_mm.size(); i += 7) {
      if (std::isnan(view.image.depth_mm[i])) continue;
      sizes.push_back(view.image.depth_mm[i] / static_cast<float>(view.image.lens.fx));
      sigmas.push_back(view.image.sigma_mm[i]);
    }
  }
  return std::max(median_in_place(sizes), median_in_place(sigmas));
}

struct Walk {
  Tracker tracker;
  ModelReport report;
  float voxel_mm = 0;
};

Result<Walk> track_all(const RecordedClouds& recorded, const ModelOptions& options, const Tell& tell) {
  Walk walk;
  for (std::size_t number = 0; number < recorded.names.size(); ++number) {
    const std::string& name = recorded.names[number];
    ++walk.report.frames;
    auto shot = read_shot(recorded, name, options);
    std::string refusal;
    if (!shot) {
      if (shot.error().code == ErrorCode::kMismatch && walk.report.frames == 1) return tl::unexpected(shot.error());
      refusal = shot.error().message;
    } else {
      if (walk.voxel_mm == 0) walk.voxel_mm = voxel_for(*shot);
      const Tracked tracked = walk.tracker.add(number, std::move(*shot));
      refusal = tracked.refusal;
      if (tracked.found_again) tell(name + ": found the object again");
    }
    if (refusal.empty()) continue;
    tell(name + ": left out: " + refusal);
    walk.report.refused.push_back({name, std::move(refusal)});
  }
  return walk;
}

double way_degrees(std::span<const ModelFrame> frames) {
  double sum = 0;
  for (std::size_t i = 1; i < frames.size(); ++i)
    sum += turn_degrees(frames[i - 1].object_from_rig, frames[i].object_from_rig);
  return sum;
}

}  // namespace

Result<Model> build_model(const RecordedClouds& recorded, const ModelOptions& options, const Tell& tell) {
  auto walk = track_all(recorded, options, tell);
  if (!walk) return tl::unexpected(walk.error());
  Model model{{}, std::move(walk->report)};
  ModelReport& report = model.report;
  std::vector<ModelFrame>& frames = walk->tracker.frames();
  if (frames.empty())
    return fail(ErrorCode::kMalformed,
                "no frame can be used: " + report.refused.front().name + ": " + report.refused.front().reason);
  report.adjustment = adjust(frames);
  report.turned_degrees = way_degrees(frames);
  report.voxel_mm = options.voxel_mm.value_or(walk->voxel_mm);
  Volume volume({.voxel_mm = report.voxel_mm, .band_mm = 5 * report.voxel_mm});
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::string& name = recorded.names[frames[i].number];
    const std::optional<double>& fit = report.adjustment.fit[i];
    if (!fit || *fit > kGreatestFitAdjusted) {
      report.refused.push_back({name, fit ? fmt::format("its surface lies {:.1f} sigma off the others'", *fit)
                                          : "no other cloud shows the same surface"});
      tell(name + ": left out: " + report.refused.back().reason);
      continue;
    }
    const auto shot = read_shot(recorded, name, options);
    if (!shot) return tl::unexpected(shot.error());
    volume.add(*shot, frames[i].object_from_rig);
    report.fused.push_back({name, frames[i].object_from_rig, *fit});
  }
  model.mesh = tidy(volume.mesh(), kSmallestPiece);
  if (model.mesh.triangles.empty())
    return fail(
        ErrorCode::kMalformed,
        "no place was measured by two clouds: record more, and turn the object by at most 15 degrees between two");
  report.volume_bytes = volume.bytes();
  std::vector<float> sigmas = model.mesh.sigma_mm;
  report.usual_sigma_mm = static_cast<double>(median_in_place(sigmas));
  return model;
}

}  // namespace slsd::model
