// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/pipeline.hpp"

#include <algorithm>
#include <cmath>

#include "core/decode/centre_sigma.hpp"

namespace slsd {

Decoder::Pipeline::Pipeline(const Pattern& pattern, const Calibration& calibration, std::size_t camera_index,
                            const DecodeOptions& options, std::optional<PaperWay> paper)
    : camera_(calibration.cameras[camera_index]),
      camera_index_(static_cast<std::uint8_t>(camera_index)),
      options_(options),
      reader_(pattern,
              ExpectedFrames(camera_, calibration.projector, std::sqrt(options.depth_min_mm * options.depth_max_mm)),
              options, std::move(paper)),
      cells_(std::make_shared<const CellRays>(reader_.cell_rays(calibration.projector))),
      camera_rays_(camera_.lens),
      epipolar_gate_(camera_, calibration.projector, options.depth_min_mm, options.depth_max_mm),
      triangulator_(camera_, calibration.projector),
      correspondence_({}) {}

const Decoding& Decoder::Pipeline::decode(const GreyView& frame, double full, StageObserver* observer) {
  const auto done = [&](Stage stage) {
    if (observer != nullptr) observer->stage_done(stage);
  };
  reader_.binarize(frame, full), done(Stage::kBinarize);
  reader_.find_regions(frame), done(Stage::kFindRegions);
  reader_.describe(frame), done(Stage::kDescribe);
  reader_.classify(), done(Stage::kClassify);
  reader_.link_grid(), done(Stage::kLinkGrid);
  decode_windows(frame), done(Stage::kDecodeWindows);
  correspond(), done(Stage::kCorrespond);
  triangulate();
  reader_.report(decoding_), done(Stage::kTriangulate);
  return decoding_;
}

void Decoder::Pipeline::find_epipolar_segments() {
  const Sightings& seen = reader_.seen();
  rays_.resize(seen.size());
  ray_pixels_.resize(seen.size());
  segments_.resize(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    ray_pixels_[i] = {seen.moments[i].x, seen.moments[i].y};
    rays_[i] = camera_rays_.ray(ray_pixels_[i].cast<double>());
    segments_[i] = epipolar_gate_.prepare(rays_[i].direction);
  }
}

void Decoder::Pipeline::decode_windows(const GreyView& frame) {
  find_epipolar_segments();
  const bool gated = options_.correspond == Method::kDefault;
  const CellGate gate(*cells_, gated ? std::span<const EpipolarSegment>(segments_) : std::span<const EpipolarSegment>(),
                      CorrespondOptions{}.epipolar_max_px);
  reader_.decode_windows(frame, gate);
}

void Decoder::Pipeline::correspond() {
  if (options_.correspond == Method::kDefault) correspondence_.correspond(*cells_, segments_, reader_.seen().claims);
}

void Decoder::Pipeline::triangulate() {
  const std::vector<Eigen::Vector2f>& centres = reader_.find_centres();
  Sightings& seen = reader_.seen();
  decoding_.points.clear();
  for (std::size_t i = 0; i < seen.size(); ++i) {
    CellClaim& claim = seen.claims[i];
    if (claim.status != RegionStatus::kDecoded) continue;
    // The correction is some tenths of a pixel, over which the ray turns evenly.
    PixelRay ray = rays_[i];
    ray.direction += ray.turn * (centres[i] - ray_pixels_[i]).cast<double>();
    const TriangulatedPoint solved =
        triangulator_.triangulate(ray, cells_->ray(claim.row, claim.column), centre_sigma_px(seen.moments[i]));
    const double depth = solved.point_in_camera.z();
    const bool gated = options_.correspond == Method::kDefault;
    const bool in_range = gated ? depth >= options_.depth_min_mm && depth <= options_.depth_max_mm : depth > 0;
    if (!in_range || !solved.point_in_camera.allFinite()) {
      claim.status = RegionStatus::kOutOfDepthRange;
    } else {
      add_point(i, centres[i], solved);
    }
  }
}

void Decoder::Pipeline::add_point(std::size_t node, const Eigen::Vector2f& centre_px, const TriangulatedPoint& solved) {
  const CellClaim& claim = reader_.seen().claims[node];
  const Eigen::Vector3f point = (camera_.rig_from_camera * solved.point_in_camera).cast<float>();
  const Eigen::Vector2f projector = cells_->pixel(claim.row, claim.column).cast<float>();
  CloudPoint& out = decoding_.points.emplace_back();
  out.x = point.x(), out.y = point.y(), out.z = point.z();
  out.camera_u = centre_px.x(), out.camera_v = centre_px.y();
  out.projector_u = projector.x(), out.projector_v = projector.y();
  out.sigma_mm = static_cast<float>(solved.sigma_mm);
  out.column = static_cast<std::uint16_t>(claim.column), out.row = static_cast<std::uint16_t>(claim.row);
  out.intensity =
      static_cast<std::uint8_t>(std::clamp(reader_.seen().moments[node].peak / reader_.frame_levels(), 0.F, 255.F));
  out.camera = camera_index_;
  out.symbol = static_cast<std::uint8_t>(reader_.pattern().options.symbols[reader_.letter_of_cell(node)]);
}

}  // namespace slsd
