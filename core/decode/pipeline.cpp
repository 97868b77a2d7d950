// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/pipeline.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "core/decode/centre_sigma.hpp"
#include "core/decode/paper/binarize.hpp"

namespace slsd {
namespace {

/// How far frames are off: the calibration's expectation by the tilt of the surface, a measured one by noise and
/// curvature.
constexpr float kExpectedFrameError = 0.15F;
constexpr float kMeasuredFrameError = 0.05F;
/// Standard deviations from the nearest prototype beyond which a shape is none of the pattern's.
constexpr float kExpectedDistanceMax = 25;
constexpr float kMeasuredDistanceMax = 20;
/// A shape this near to its prototype, and this much likelier than any other, need not be looked at in the measured
/// frame.
constexpr float kDecidedDistance = 3;
constexpr float kDecidedLogProbability = -0.01F;
/// Least and greatest area of a region, as a share of a symbol's square and of a cell.
constexpr float kAreaMin = 0.08F;
constexpr float kAreaMax = 1.1F;
constexpr int kAreaMinPx = 6;
constexpr float kExtentMax = 1.5F;  // of a cell's side
/// Levels between a merged region's dark and light at which it is taken apart.
constexpr float kSplitLevels[] = {0.35F, 0.6F};
/// What is larger than this is not a few symbols that ran together.
constexpr int kSplitAreaMaxPx = 20000;
/// Grey levels of 255 between a region's peak and its background.
constexpr float kContrastMin = 8;

std::vector<Prototype> prototypes_for(const Pattern& pattern, float scale, float frame_error) {
  return make_prototypes(
      {pattern.options.symbols, pattern.options.symbol_size_px, pattern.options.spacing_px, scale, frame_error});
}

/// The centroids that the estimator in use finds: the paper's are those of the symbols as they are drawn.
std::vector<Prototype> with_centroids_of(Method centre, const Pattern& pattern, std::vector<Prototype> prototypes) {
  if (centre == Method::kDefault) return prototypes;
  for (std::size_t i = 0; i < prototypes.size(); ++i) {
    const Descriptors drawn = describe_shape(draw_symbol(pattern.options.symbols[i], pattern.options.symbol_size_px));
    const double middle = 0.5 * (pattern.options.symbol_size_px - 1);
    prototypes[i].centroid_px = (drawn.centroid_px.array() - middle).cast<float>();
  }
  return prototypes;
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

float grey_levels(const GreyView& frame) {
  return std::holds_alternative<ImageView<std::uint8_t>>(frame) ? 1.F : 257.F;
}

}  // namespace

Decoder::Pipeline::Pipeline(const Pattern& pattern, const Calibration& calibration, std::size_t camera_index,
                            const DecodeOptions& options, std::optional<PaperWay> paper)
    : pattern_(pattern),
      camera_(calibration.cameras[camera_index]),
      camera_index_(static_cast<std::uint8_t>(camera_index)),
      options_(options),
      paper_(std::move(paper)),
      expected_(camera_, calibration.projector, std::sqrt(options.depth_min_mm * options.depth_max_mm)),
      prototypes_as_expected_(prototypes_for(pattern, expected_.in_the_middle().scale, kExpectedFrameError)),
      prototypes_as_measured_(prototypes_for(pattern, expected_.in_the_middle().scale, kMeasuredFrameError)),
      classifier_as_expected_(prototypes_as_expected_, kExpectedDistanceMax),
      classifier_as_measured_(prototypes_as_measured_, kMeasuredDistanceMax),
      cells_(pattern, with_centroids_of(options.centre, pattern, prototypes_as_measured_), calibration.projector),
      camera_rays_(camera_.lens),
      epipolar_gate_(camera_, calibration.projector, options.depth_min_mm, options.depth_max_mm),
      triangulator_(camera_, calibration.projector),
      binarizer_(binarize_options(pattern, expected_.in_the_middle().scale)),
      meter_(margin_px(pattern.options.spacing_px, expected_.in_the_middle().scale)),
      linker_({.pitch_px = static_cast<float>(pattern.pitch_px())}),
      window_decoder_(pattern, {.rows = pattern.whole_rows(), .columns = pattern.whole_columns()},
                      radius_of(pattern.array)),
      review_(pattern, prototypes_as_measured_, {}),
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
  classify(), done(Stage::kClassify);
  link_grid(), done(Stage::kLinkGrid);
  decode_windows(frame), done(Stage::kDecodeWindows);
  correspond(), done(Stage::kCorrespond);
  triangulate();
  report(), done(Stage::kTriangulate);
  return decoding_;
}

void Decoder::Pipeline::binarize(const GreyView& frame) {
  if (options_.binarize == Method::kPaper) return binarize_paper(frame, mask_);
  binarizer_.binarize(frame, mask_);
}

void Decoder::Pipeline::find_regions(const GreyView& frame) {
  region_finder_.find(mask_.view(), regions_);
  if (options_.binarize == Method::kPaper) return;
  splitter_.split_all(frame, kSplitLevels, regions_, [this](const Region& region) {
    return region.area_px <= kSplitAreaMaxPx && judge_size(region) == RegionStatus::kTooLarge;
  });
}

RegionStatus Decoder::Pipeline::judge_size(const Region& region) const {
  if (region.left == 0 || region.top == 0 || region.right == mask_.width() - 1 || region.bottom == mask_.height() - 1) {
    return RegionStatus::kTouchesBorder;
  }
  const Eigen::Vector2f middle = region.middle_px();
  const float scale = expected_.at(middle.x(), middle.y()).scale, square_px = scale * scale;
  const float size = static_cast<float>(pattern_.options.symbol_size_px),
              pitch = static_cast<float>(pattern_.pitch_px());
  const float area = static_cast<float>(region.area_px);
  if (region.area_px < kAreaMinPx || area < kAreaMin * size * size * square_px) return RegionStatus::kTooSmall;
  const float extent = static_cast<float>(std::max(region.width_px(), region.height_px()));
  const bool too_large = area > kAreaMax * pitch * pitch * square_px || extent > kExtentMax * pitch * scale;
  return too_large ? RegionStatus::kTooLarge : RegionStatus::kNoNeighbour;
}

void Decoder::Pipeline::describe(const GreyView& frame) {
  frame_levels_ = grey_levels(frame);
  region_status_.resize(regions_.regions.size());
  seen_.clear();
  for (std::size_t i = 0; i < regions_.regions.size(); ++i) {
    const Region& region = regions_.regions[i];
    region_status_[i] = judge_size(region);
    if (region_status_[i] != RegionStatus::kNoNeighbour) continue;
    const GreyMoments moments =
        std::visit([&](const auto& view) { return meter_.measure(view, region, regions_.runs_of(region)); }, frame);
    if (moments.weight <= 0 || moments.peak - moments.background < kContrastMin * frame_levels_) {
      region_status_[i] = RegionStatus::kLowContrast;
      continue;
    }
    seen_.region.push_back(static_cast<std::int32_t>(i));
    seen_.moments.push_back(moments);
  }
  if (paper_) paper_->describe(regions_, seen_);
  if (options_.centre == Method::kPaper) paper_->centre(seen_);
}

void Decoder::Pipeline::classify() {
  const float size = static_cast<float>(pattern_.options.symbol_size_px);
  seen_.shapes.resize(seen_.size());
  seen_.nodes.assign(seen_.size(), {});
  if (options_.classify == Method::kPaper) paper_->classify(size * expected_.in_the_middle().scale, seen_);
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    const GreyMoments& moments = seen_.moments[i];
    GridNode& node = seen_.nodes[i];
    const ExpectedFrame& expected = expected_.at(moments.x, moments.y);
    node.frame = expected.frame;
    node.centre_px = {moments.x, moments.y};
    if (options_.classify == Method::kDefault) {
      seen_.shapes[i] = classifier_as_expected_.classify(shape_features(moments, expected.inverse, size));
    }
    if (seen_.shapes[i].letter >= 0)
      node.centre_px -= node.frame * prototypes_as_expected_[seen_.shapes[i].letter].centroid_px;
  }
}

void Decoder::Pipeline::link_grid() {
  if (options_.link_grid == Method::kPaper) return paper_->link_grid(regions_, mask_.width(), mask_.height(), seen_);
  linker_.link(seen_.nodes);
  if (options_.classify == Method::kDefault) classify_in_measured_frames();
}

void Decoder::Pipeline::classify_in_measured_frames() {
  const float size = static_cast<float>(pattern_.options.symbol_size_px);
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    const GridNode& node = seen_.nodes[i];
    const Classification& before = seen_.shapes[i];
    const bool decided = before.letter >= 0 && before.distance < kDecidedDistance &&
                         before.log_probability[before.letter] > kDecidedLogProbability;
    if (decided || !node.measured_u || !node.measured_v) continue;
    seen_.shapes[i] = classifier_as_measured_.classify(shape_features(seen_.moments[i], node.frame.inverse(), size));
  }
}

void Decoder::Pipeline::find_epipolar_segments() {
  rays_.resize(seen_.size());
  ray_pixels_.resize(seen_.size());
  segments_.resize(seen_.size());
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    ray_pixels_[i] = {seen_.moments[i].x, seen_.moments[i].y};
    rays_[i] = camera_rays_.ray(ray_pixels_[i].cast<double>());
    segments_[i] = epipolar_gate_.prepare(rays_[i].direction);
  }
}

bool Decoder::Pipeline::reviews() const {
  return options_.classify == Method::kDefault && options_.centre == Method::kDefault &&
         options_.decode_windows == Method::kDefault;
}

void Decoder::Pipeline::decode_windows(const GreyView& frame) {
  find_epipolar_segments();
  if (options_.decode_windows == Method::kPaper) return paper_->decode_windows(cells_.rows(), cells_.columns(), seen_);
  const bool gated = options_.correspond == Method::kDefault;
  const CellGate gate(cells_, gated ? std::span<const EpipolarSegment>(segments_) : std::span<const EpipolarSegment>(),
                      CorrespondOptions{}.epipolar_max_px);
  window_decoder_.decode(seen_.nodes, seen_.shapes, gate, seen_.claims);
  if (reviews()) review_.review(frame, regions_, linker_, meter_, seen_);
}

void Decoder::Pipeline::correspond() {
  if (options_.correspond == Method::kDefault) correspondence_.correspond(cells_, segments_, seen_.claims);
}

void Decoder::Pipeline::triangulate() {
  letters_.resize(seen_.size());
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    const CellClaim& claim = seen_.claims[i];
    letters_[i] = static_cast<std::int8_t>(claim.named() ? pattern_.array.at(claim.row, claim.column) : -1);
  }
  centre_correction_.correct(seen_.nodes, seen_.moments, seen_.claims, letters_, centres_);
  decoding_.points.clear();
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    CellClaim& claim = seen_.claims[i];
    if (claim.status != RegionStatus::kDecoded) continue;
    const GreyMoments& moments = seen_.moments[i];
    if (options_.centre == Method::kPaper) centres_[i] = {moments.x, moments.y};
    // The correction is some tenths of a pixel, over which the ray turns evenly.
    PixelRay ray = rays_[i];
    ray.direction += ray.turn * (centres_[i] - ray_pixels_[i]).cast<double>();
    const TriangulatedPoint solved =
        triangulator_.triangulate(ray, cells_.ray(claim.row, claim.column), centre_sigma_px(moments));
    const double depth = solved.point_in_camera.z();
    const bool gated = options_.correspond == Method::kDefault;
    const bool in_range = gated ? depth >= options_.depth_min_mm && depth <= options_.depth_max_mm : depth > 0;
    if (!in_range || !solved.point_in_camera.allFinite()) {
      claim.status = RegionStatus::kOutOfDepthRange;
    } else {
      add_point(i, solved);
    }
  }
}

void Decoder::Pipeline::add_point(std::size_t node, const TriangulatedPoint& solved) {
  const CellClaim& claim = seen_.claims[node];
  const Eigen::Vector3f point = (camera_.rig_from_camera * solved.point_in_camera).cast<float>();
  const Eigen::Vector2f projector = cells_.pixel(claim.row, claim.column).cast<float>();
  CloudPoint& out = decoding_.points.emplace_back();
  out.x = point.x(), out.y = point.y(), out.z = point.z();
  out.camera_u = centres_[node].x(), out.camera_v = centres_[node].y();
  out.projector_u = projector.x(), out.projector_v = projector.y();
  out.sigma_mm = static_cast<float>(solved.sigma_mm);
  out.column = static_cast<std::uint16_t>(claim.column), out.row = static_cast<std::uint16_t>(claim.row);
  out.intensity = static_cast<std::uint8_t>(std::clamp(seen_.moments[node].peak / frame_levels_, 0.F, 255.F));
  out.camera = camera_index_;
  out.symbol = static_cast<std::uint8_t>(pattern_.options.symbols[letters_[node]]);
}

void Decoder::Pipeline::report() {
  decoding_.regions.resize(regions_.regions.size());
  for (std::size_t i = 0; i < regions_.regions.size(); ++i) {
    decoding_.regions[i] = {regions_.regions[i].middle_px(), region_status_[i], -1, {-1, -1, -1, -1}, {}, -1, -1};
  }
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    RegionSeen& out = decoding_.regions[seen_.region[i]];
    const GridNode& node = seen_.nodes[i];
    out.centre_px = {seen_.moments[i].x, seen_.moments[i].y};
    out.status = seen_.claims[i].status;
    out.letter = seen_.shapes[i].letter;
    for (int d = 0; d < 4; ++d) out.links[d] = node.links[d] < 0 ? -1 : seen_.region[node.links[d]];
    out.broken = node.broken;
    if (out.status == RegionStatus::kDecoded) out.column = seen_.claims[i].column, out.row = seen_.claims[i].row;
  }
  decoding_.counts = {};
  for (const RegionSeen& region : decoding_.regions) ++decoding_.counts[static_cast<std::size_t>(region.status)];
}

}  // namespace slsd
