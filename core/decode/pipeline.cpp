// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/pipeline.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

namespace slsd {
namespace {

/// How far frames are off: the calibration's expectation by the tilt of the surface, a measured one by noise and
/// curvature.
constexpr float kExpectedFrameError = 0.15F;
constexpr float kMeasuredFrameError = 0.05F;
/// Standard deviations from the nearest prototype beyond which a shape is none of the pattern's.
constexpr float kExpectedDistanceMax = 12;
constexpr float kMeasuredDistanceMax = 8;
/// Least and greatest area of a region, as a share of a symbol's square and of a cell.
constexpr float kAreaMin = 0.08F;
constexpr float kAreaMax = 1.1F;
constexpr int kAreaMinPx = 6;
/// Change of the light from cell to cell from which on a symbol is measured again with the light levelled.
constexpr float kShadingMin = 0.04F;
/// Standard deviations from its letter's prototype: a symbol beyond the first is measured again where its neighbours
/// put it, one that stays beyond the second is damaged (cut by an edge, a shadow, print) and its centre with it.
constexpr float kDoubtfulDistance = 1.5F;
constexpr float kDamagedDistance = 2.5F;
/// Levels between a merged region's dark and light at which it is taken apart.
constexpr float kSplitLevels[] = {0.35F, 0.6F};
/// What is larger than this is not a few symbols that ran together.
constexpr int kSplitAreaMaxPx = 20000;
/// Grey levels of 255 between a region's peak and its background.
constexpr float kContrastMin = 8;

PrototypeOptions prototype_options(const Pattern& pattern, float scale, float frame_error) {
  return {pattern.options.symbols, pattern.options.symbol_size_px, pattern.options.spacing_px, scale, frame_error};
}

BinarizeOptions binarize_options(const Pattern& pattern, float scale) {
  const float pitch = static_cast<float>(pattern.pitch_px()) * scale;
  return {.tile_px = std::clamp(static_cast<int>(std::lround(0.5F * pitch)), 4, 64),
          .level = threshold_level(pattern.options.spacing_px, scale)};
}

/// Errors that the array's distance corrects; more than one costs more memory than it gains.
int radius_of(const CodeArray& array) {
  return minimum_window_distance(array) >= 3 ? 1 : 0;
}

/// Relative change of the light from one cell to the next along a direction, from the peaks of the neighbours.
float light_change(const std::vector<GridNode>& nodes, const std::vector<GreyMoments>& moments, std::size_t node,
                   Direction direction) {
  const auto light = [&](std::int32_t at) { return moments[at].peak - moments[at].background; };
  const auto self = static_cast<std::int32_t>(node);
  const std::int32_t next = neighbour(nodes, self, direction), last = neighbour(nodes, self, opposite(direction));
  const std::int32_t from = last >= 0 ? last : self, to = next >= 0 ? next : self;
  const float steps = static_cast<float>((last >= 0) + (next >= 0));
  return steps == 0 ? 0.F : (light(to) - light(from)) / (steps * light(self));
}

/// Where the neighbours put a node, by continuing the steps of those beside it; quadratic, as steps shrink towards a
/// limb.
std::optional<Eigen::Vector2f> centre_from_neighbours(const std::vector<GridNode>& nodes, std::size_t node) {
  Eigen::Vector2f sum = Eigen::Vector2f::Zero();
  int count = 0;
  for (const Direction d : {kRight, kDown, kLeft, kUp}) {
    const std::int32_t first = neighbour(nodes, static_cast<std::int32_t>(node), d),
                       second = neighbour(nodes, first, d);
    const std::int32_t third = neighbour(nodes, second, d);
    if (third < 0) continue;
    sum += 3 * nodes[first].centre_px - 3 * nodes[second].centre_px + nodes[third].centre_px;
    ++count;
  }
  if (count == 0) return std::nullopt;
  return sum / static_cast<float>(count);
}

/// The same along both axes, the mean with the neighbours': small symbols blur to lower peaks, which is not the light's
/// doing.
Eigen::Vector2f light_change_around(const std::vector<GridNode>& nodes, const std::vector<GreyMoments>& moments,
                                    std::size_t node) {
  Eigen::Vector2f sum(light_change(nodes, moments, node, kRight), light_change(nodes, moments, node, kDown));
  float count = 1;
  for (const Direction d : {kRight, kDown, kLeft, kUp}) {
    const std::int32_t other = neighbour(nodes, static_cast<std::int32_t>(node), d);
    if (other < 0) continue;
    const auto at = static_cast<std::size_t>(other);
    sum += Eigen::Vector2f(light_change(nodes, moments, at, kRight), light_change(nodes, moments, at, kDown));
    ++count;
  }
  return sum / count;
}

float grey_levels(const GreyView& frame) {
  return std::holds_alternative<ImageView<std::uint8_t>>(frame) ? 1.F : 257.F;
}

}  // namespace

Decoder::Pipeline::Pipeline(const Pattern& pattern, const Calibration& calibration, std::size_t camera_index,
                            const DecodeOptions& options)
    : pattern_(pattern),
      camera_(calibration.cameras[camera_index]),
      camera_index_(static_cast<std::uint8_t>(camera_index)),
      options_(options),
      expected_(camera_, calibration.projector, std::sqrt(options.depth_min_mm * options.depth_max_mm)),
      prototypes_as_expected_(
          make_prototypes(prototype_options(pattern, expected_.middle_scale(), kExpectedFrameError))),
      prototypes_as_measured_(
          make_prototypes(prototype_options(pattern, expected_.middle_scale(), kMeasuredFrameError))),
      cells_(pattern, prototypes_as_measured_, calibration.projector),
      camera_rays_(camera_.lens),
      epipolar_gate_(camera_, calibration.projector, options.depth_min_mm, options.depth_max_mm),
      triangulator_(camera_, calibration.projector),
      binarizer_(binarize_options(pattern, expected_.middle_scale())),
      meter_(margin_px(pattern.options.spacing_px, expected_.middle_scale())),
      linker_({.pitch_px = static_cast<float>(pattern.pitch_px())}),
      window_decoder_(pattern, {.rows = pattern.whole_rows(), .columns = pattern.whole_columns()},
                      radius_of(pattern.array)),
      correspondence_({}),
      centre_correction_(prototypes_as_measured_, static_cast<float>(pattern.pitch_px()),
                         static_cast<float>(pattern.options.symbol_size_px)) {}

const Decoding& Decoder::Pipeline::decode(const GreyView& frame, StageObserver* observer) {
  const auto done = [&](Stage stage) {
    if (observer != nullptr) observer->stage_done(stage);
  };
  binarize(frame), done(Stage::kBinarize);
  find_regions(frame), done(Stage::kFindRegions);
  describe(frame), done(Stage::kDescribe);
  classify_as_expected(), done(Stage::kClassify);
  link_grid(), done(Stage::kLinkGrid);
  classify_as_measured();
  decode_windows();
  measure_again(frame), done(Stage::kDecodeWindows);
  correspond(), done(Stage::kCorrespond);
  correct_centres();
  triangulate();
  report(), done(Stage::kTriangulate);
  return decoding_;
}

void Decoder::Pipeline::binarize(const GreyView& frame) {
  binarizer_.binarize(frame, mask_);
}

void Decoder::Pipeline::find_regions(const GreyView& frame) {
  region_finder_.find(mask_.view(), regions_);
  split_merged(frame);
}

void Decoder::Pipeline::split_merged(const GreyView& frame) {
  for (const float level : kSplitLevels) {
    const std::size_t count = regions_.regions.size();
    for (std::size_t i = 0; i < count; ++i) {
      const Region region = regions_.regions[i];
      if (judge_size(region) != RegionStatus::kTooLarge || region.area_px > kSplitAreaMaxPx) continue;
      std::visit(
          [&](const auto& view) {
            const Regions& parts = splitter_.split(view, region, regions_.runs_of(region), level);
            if (parts.regions.size() < 2) return;
            for (const Region& part : parts.regions) regions_.append(part, parts.runs_of(part));
            regions_.regions[i].area_px = 0;
          },
          frame);
    }
    std::erase_if(regions_.regions, [](const Region& region) { return region.area_px == 0; });
  }
}

RegionStatus Decoder::Pipeline::judge_size(const Region& region) const {
  if (region.left == 0 || region.top == 0 || region.right == mask_.width() - 1 || region.bottom == mask_.height() - 1) {
    return RegionStatus::kTouchesBorder;
  }
  const LatticeFrame& frame = expected_.at(0.5F * static_cast<float>(region.left + region.right),
                                           0.5F * static_cast<float>(region.top + region.bottom));
  const float scale_squared = std::abs(frame.determinant());
  const float size = static_cast<float>(pattern_.options.symbol_size_px),
              pitch = static_cast<float>(pattern_.pitch_px());
  const float area = static_cast<float>(region.area_px);
  if (region.area_px < kAreaMinPx || area < kAreaMin * size * size * scale_squared) return RegionStatus::kTooSmall;
  const float extent = static_cast<float>(std::max(region.width_px(), region.height_px()));
  if (area > kAreaMax * pitch * pitch * scale_squared || extent > 1.5F * pitch * std::sqrt(scale_squared))
    return RegionStatus::kTooLarge;
  return RegionStatus::kNoNeighbour;
}

void Decoder::Pipeline::describe(const GreyView& frame) {
  const float contrast_min = kContrastMin * grey_levels(frame);
  region_status_.resize(regions_.regions.size());
  region_of_node_.clear();
  moments_.clear();
  for (std::size_t i = 0; i < regions_.regions.size(); ++i) {
    const Region& region = regions_.regions[i];
    region_status_[i] = judge_size(region);
    if (region_status_[i] != RegionStatus::kNoNeighbour) continue;
    const GreyMoments moments =
        std::visit([&](const auto& view) { return meter_.measure(view, region, regions_.runs_of(region)); }, frame);
    if (moments.peak - moments.background < contrast_min || moments.weight <= 0) {
      region_status_[i] = RegionStatus::kLowContrast;
      continue;
    }
    region_of_node_.push_back(static_cast<std::int32_t>(i));
    moments_.push_back(moments);
  }
}

void Decoder::Pipeline::classify_as_expected() {
  const float size = static_cast<float>(pattern_.options.symbol_size_px);
  shapes_.resize(moments_.size());
  nodes_.assign(moments_.size(), {});
  for (std::size_t i = 0; i < moments_.size(); ++i) {
    const LatticeFrame& frame = expected_.at(moments_[i].x, moments_[i].y);
    shapes_[i] =
        classify(shape_features(moments_[i], frame.inverse(), size), prototypes_as_expected_, kExpectedDistanceMax);
    nodes_[i].frame = frame;
    nodes_[i].centre_px = {moments_[i].x, moments_[i].y};
    if (shapes_[i].letter >= 0) nodes_[i].centre_px -= frame * prototypes_as_expected_[shapes_[i].letter].centroid_px;
  }
}

void Decoder::Pipeline::link_grid() {
  linker_.link(nodes_);
}

void Decoder::Pipeline::classify_as_measured() {
  const float size = static_cast<float>(pattern_.options.symbol_size_px);
  for (std::size_t i = 0; i < moments_.size(); ++i) {
    const bool measured = nodes_[i].measured_u && nodes_[i].measured_v;
    if (!measured) continue;
    shapes_[i] = classify(shape_features(moments_[i], nodes_[i].frame.inverse(), size), prototypes_as_measured_,
                          kMeasuredDistanceMax);
  }
}

void Decoder::Pipeline::decode_windows() {
  rays_.resize(moments_.size());
  segments_.resize(moments_.size());
  for (std::size_t i = 0; i < moments_.size(); ++i) {
    rays_[i] = camera_rays_.ray({moments_[i].x, moments_[i].y});
    segments_[i] = epipolar_gate_.prepare(rays_[i].direction);
  }
  window_decoder_.decode(nodes_, shapes_, CellGate(cells_, segments_, CorrespondOptions{}.epipolar_max_px), claims_);
}

void Decoder::Pipeline::correspond() {
  correspondence_.correspond(cells_, segments_, claims_);
}

void Decoder::Pipeline::trust_whole_symbols() {
  trusted_.resize(claims_.size());
  for (std::size_t i = 0; i < claims_.size(); ++i) trusted_[i] = claims_[i].status == RegionStatus::kDecoded;
  linker_.measure_frames(nodes_, trusted_);
  for (std::size_t i = 0; i < claims_.size(); ++i) {
    if (trusted_[i] != 0) trusted_[i] = distance_from_letter(i, moments_[i]) <= kDamagedDistance;
  }
  linker_.measure_frames(nodes_, trusted_);
}

float Decoder::Pipeline::distance_from_letter(std::size_t node, const GreyMoments& moments) const {
  const Prototype& prototype = prototypes_as_measured_[pattern_.array.at(claims_[node].row, claims_[node].column)];
  const float size = static_cast<float>(pattern_.options.symbol_size_px);
  return (prototype.whitening * (shape_features(moments, nodes_[node].frame.inverse(), size) - prototype.mean)).norm();
}

void Decoder::Pipeline::measure_again(const GreyView& frame) {
  trust_whole_symbols();
  const float size = static_cast<float>(pattern_.options.symbol_size_px),
              pitch = static_cast<float>(pattern_.pitch_px());
  for (std::size_t i = 0; i < claims_.size(); ++i) {
    if (claims_[i].status != RegionStatus::kDecoded) continue;
    const GridNode& node = nodes_[i];
    const Prototype& prototype = prototypes_as_measured_[pattern_.array.at(claims_[i].row, claims_[i].column)];
    const Eigen::Matrix2f inverse = node.frame.inverse();
    float distance = distance_from_letter(i, moments_[i]);
    const auto adopt_if_better = [&](const GreyMoments& again, float tolerance) {
      const float distance_again = distance_from_letter(i, again);
      if (again.weight > 0 && distance_again < distance + tolerance) moments_[i] = again, distance = distance_again;
    };
    const Eigen::Vector2f per_cell = light_change_around(nodes_, moments_, i);
    const Eigen::Vector2f shading = inverse.transpose() * per_cell / pitch;
    const Region& region = regions_.regions[region_of_node_[i]];
    if (per_cell.cwiseAbs().maxCoeff() > kShadingMin) {
      adopt_if_better(
          std::visit([&](const auto& view) { return meter_.measure(view, region, regions_.runs_of(region), shading); },
                     frame),
          0.3F);
    }
    if (distance > kDoubtfulDistance) {
      const Eigen::Vector2f centroid(moments_[i].x, moments_[i].y);
      const Eigen::Vector2f centre =
          centre_from_neighbours(nodes_, i).value_or(centroid - node.frame * prototype.centroid_px);
      const float half_px = 0.5F * size + 0.25F * (pitch - size);
      adopt_if_better(
          std::visit([&](const auto& view) { return meter_.measure_cell(view, centre, node.frame, half_px, shading); },
                     frame),
          0);
    }
    shapes_[i].distance = distance;
    if (distance > kDamagedDistance) claims_[i].status = RegionStatus::kDamagedShape;
  }
}

void Decoder::Pipeline::correct_centres() {
  letters_.resize(claims_.size());
  for (std::size_t i = 0; i < claims_.size(); ++i) {
    letters_[i] = claims_[i].named() ? static_cast<std::int8_t>(pattern_.array.at(claims_[i].row, claims_[i].column))
                                     : std::int8_t{-1};
  }
  centre_correction_.correct(nodes_, moments_, claims_, letters_, centres_);
}

void Decoder::Pipeline::triangulate() {
  decoding_.points.clear();
  for (std::size_t i = 0; i < claims_.size(); ++i) {
    const CellClaim& claim = claims_[i];
    if (claim.status != RegionStatus::kDecoded) continue;
    const TriangulatedPoint solved = triangulator_.triangulate(camera_rays_.ray(centres_[i].cast<double>()),
                                                               cells_.ray(claim.row, claim.column), 0.03);
    if (!(solved.point_in_camera.z() >= options_.depth_min_mm && solved.point_in_camera.z() <= options_.depth_max_mm)) {
      claims_[i].status = RegionStatus::kOutOfDepthRange;
      continue;
    }
    const Eigen::Vector3f point = (camera_.rig_from_camera * solved.point_in_camera).cast<float>();
    const Eigen::Vector2f projector = cells_.pixel(claim.row, claim.column).cast<float>();
    CloudPoint& out = decoding_.points.emplace_back();
    out.x = point.x(), out.y = point.y(), out.z = point.z();
    out.camera_u = centres_[i].x(), out.camera_v = centres_[i].y();
    out.projector_u = projector.x(), out.projector_v = projector.y();
    out.sigma_mm = static_cast<float>(solved.sigma_mm);
    out.column = static_cast<std::uint16_t>(claim.column), out.row = static_cast<std::uint16_t>(claim.row);
    out.intensity = static_cast<std::uint8_t>(std::clamp(moments_[i].peak, 0.F, 255.F));
    out.camera = camera_index_;
    out.symbol = static_cast<std::uint8_t>(pattern_.options.symbols[pattern_.array.at(claim.row, claim.column)]);
  }
}

void Decoder::Pipeline::report() {
  decoding_.counts = {};
  decoding_.regions.resize(regions_.regions.size());
  for (std::size_t i = 0; i < regions_.regions.size(); ++i) {
    const Region& region = regions_.regions[i];
    RegionSeen& seen = decoding_.regions[i];
    seen = {};
    seen.centre_px = {0.5F * static_cast<float>(region.left + region.right),
                      0.5F * static_cast<float>(region.top + region.bottom)};
    seen.status = region_status_[i];
    seen.letter = -1;
    seen.links.fill(-1);
    seen.column = seen.row = -1;
  }
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    RegionSeen& seen = decoding_.regions[region_of_node_[i]];
    seen.centre_px = {moments_[i].x, moments_[i].y};
    seen.status = claims_[i].status;
    seen.letter = shapes_[i].letter;
    for (int d = 0; d < 4; ++d) seen.links[d] = nodes_[i].links[d] < 0 ? -1 : region_of_node_[nodes_[i].links[d]];
    seen.broken = nodes_[i].broken;
    if (seen.status == RegionStatus::kDecoded) seen.column = claims_[i].column, seen.row = claims_[i].row;
  }
  for (const RegionSeen& seen : decoding_.regions) ++decoding_.counts[static_cast<std::size_t>(seen.status)];
}

}  // namespace slsd
