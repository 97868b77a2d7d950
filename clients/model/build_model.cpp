// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/build_model.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "clients/model/mesh/tidy_mesh.hpp"
#include "clients/model/mesh/volume.hpp"
#include "core/cloud/read_dense_ply.hpp"
#include "core/geometry/robust.hpp"

namespace slsd::model {
namespace {

/// A frame whose surface lies so many sigma off the others', usually, was wrongly tracked.
constexpr double kGreatestFitAdjusted = 2.5;
/// Smaller pieces of surface, as a share of it, are taken for stray points.
constexpr double kSmallestPiece = 0.001;

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

/// Share of the area whose triangles have a vertex that no cloud measured.
double invented_share(const Mesh& mesh) {
  double all = 0, invented = 0;
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3f& first = mesh.vertices_mm[triangle[0]];
    const double area = (mesh.vertices_mm[triangle[1]] - first).cross(mesh.vertices_mm[triangle[2]] - first).norm() / 2;
    all += area;
    if (std::ranges::any_of(triangle, [&](std::uint32_t vertex) { return mesh.frames[vertex] == 0; })) invented += area;
  }
  return all > 0 ? invented / all : 0;
}

/// The refused frame whose reason most of them share.
const RefusedFrame& usual_refusal(const std::vector<RefusedFrame>& refused) {
  return *std::ranges::max_element(refused, {}, [&](const RefusedFrame& frame) {
    return std::ranges::count(refused, frame.reason, &RefusedFrame::reason);
  });
}

double way_degrees(std::span<const ModelFrame> frames) {
  double sum = 0;
  for (std::size_t i = 1; i < frames.size(); ++i)
    sum += turn_degrees(frames[i - 1].object_from_rig, frames[i].object_from_rig);
  return sum;
}

}  // namespace

ModelBuilder::ModelBuilder(Calibration calibration, const ModelOptions& options)
    : calibration_(std::move(calibration)), options_(options), tracker_(options.step_degrees) {}

Result<> ModelBuilder::set_background(std::string_view ply) {
  const auto points = read_dense_ply(ply);
  if (!points) return tl::unexpected(points.error());
  auto background = Background::of(*points, calibration_);
  if (!background) return tl::unexpected(background.error());
  background_ = std::move(*background);
  return {};
}

Result<std::vector<RangeImage>> ModelBuilder::read_images(std::string_view ply) const {
  const auto points = read_dense_ply(ply);
  if (!points) return tl::unexpected(points.error());
  auto images = range_images(*points, calibration_, options_.box);
  if (!images) return tl::unexpected(images.error());
  if (background_) background_->remove_from(*images);
  return images;
}

Result<ModelBuilder::Added> ModelBuilder::add(const std::string& name, std::string_view ply) {
  names_.push_back(name);
  ++report_.frames;
  auto images = read_images(ply);
  Added added;
  if (images) {
    Shot shot = make_shot(std::move(*images));
    if (voxel_mm_ == 0) voxel_mm_ = voxel_for(shot);
    Tracked tracked = tracker_.add(names_.size() - 1, std::move(shot));
    added = {std::move(tracked.refusal), tracked.found_again};
  } else {
    if (images.error().code == ErrorCode::kMismatch && report_.frames == 1) return tl::unexpected(images.error());
    added.refusal = images.error().message;
  }
  if (!added.refusal.empty()) report_.refused.push_back({name, added.refusal});
  return added;
}

void ModelBuilder::leave_out(const std::string& name, std::string reason) {
  names_.push_back(name);
  ++report_.frames;
  report_.refused.push_back({name, std::move(reason)});
}

SeenSides ModelBuilder::sides() const {
  std::vector<RigidTransform> places;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const ModelFrame& frame : tracker_.frames()) {
    places.push_back(frame.object_from_rig);
    middle += frame.object_from_rig.rotation * frame.shot.middle_mm() + frame.object_from_rig.translation;
  }
  return seen_sides(places, middle / static_cast<double>(std::max<std::size_t>(1, places.size())));
}

bool ModelBuilder::closed(const SeenSides& sides) const {
  const std::vector<ModelFrame>& frames = tracker_.frames();
  if (frames.empty() || !sides.all()) return false;
  for (std::size_t early = 0; early + 1 < frames.size(); ++early)
    if (came_round(frames, early, frames.size() - 1)) return true;
  return false;
}

Result<Model> ModelBuilder::finish(const Read& read, const Tell& tell, const Advance& advance) {
  Model model{{}, std::move(report_)};
  ModelReport& report = model.report;
  const std::size_t lost = report.refused.size();
  std::vector<ModelFrame>& frames = tracker_.frames();
  if (frames.empty())
    return fail(ErrorCode::kMalformed, report.refused.empty() ? "no cloud arrived"
                                                              : "no frame is usable: " + report.refused.front().name +
                                                                    ": " + report.refused.front().reason);
  if (advance) advance(0, 0);
  tracker_.mark_foreign_cells();
  report.adjustment = adjust(frames);
  tracker_.mark_foreign_cells();
  report.turned_degrees = way_degrees(frames);
  report.voxel_mm = options_.voxel_mm.value_or(voxel_mm_);
  Volume volume({.voxel_mm = report.voxel_mm, .band_mm = 5 * report.voxel_mm});
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (advance) advance(i, frames.size());
    const std::string& name = names_[frames[i].number];
    const std::optional<double>& fit = report.adjustment.fit[i];
    if (!fit || *fit > kGreatestFitAdjusted) {
      report.refused.push_back({name, fit ? fmt::format("its surface lies {:.1f} sigma off the others'", *fit)
                                          : "no other cloud shows the same surface"});
      tell(name + ": left out: " + report.refused.back().reason);
      continue;
    }
    const auto ply = read(name);
    if (!ply) return tl::unexpected(ply.error());
    auto images = read_images(*ply);
    if (!images) return tl::unexpected(images.error());
    drop_foreign(*images, frames[i].shot);
    volume.add(make_shot_to_fuse(std::move(*images)), frames[i].object_from_rig);
    report.fused.push_back({name, frames[i].object_from_rig, *fit});
  }
  if (advance) advance(frames.size(), frames.size());
  model.mesh = tidy(options_.close ? volume.closed_mesh() : volume.mesh(), kSmallestPiece);
  if (model.mesh.triangles.empty()) {
    std::string what = "no place was measured by two clouds: ";
    if (2 * lost >= report.frames) {
      const RefusedFrame& usual = usual_refusal(report.refused);
      what += fmt::format("{} of {} were left out; {}: {}", lost, report.frames, usual.name, usual.reason);
    } else {
      what += "record more, and turn the object by at most 15 degrees between two";
    }
    return fail(ErrorCode::kMalformed, std::move(what));
  }
  report.volume_bytes = volume.bytes();
  report.invented_share = invented_share(model.mesh);
  std::vector<float> sigmas = model.mesh.sigma_mm;
  std::erase_if(sigmas, [](float sigma) { return std::isnan(sigma); });
  report.usual_sigma_mm = static_cast<double>(median_in_place(sigmas));
  return model;
}

}  // namespace slsd::model
