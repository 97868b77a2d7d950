// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/regions/shape_finder.hpp"

#include <algorithm>
#include <cmath>

#include "core/decode/symbols/prototypes.hpp"
#include "core/paper/binarize.hpp"

namespace slsd {
namespace {

/// Least and greatest area of a region, as a share of a symbol's square and of a cell.
constexpr float kAreaMin = 0.08F;
constexpr float kAreaMax = 1.1F;
constexpr int kAreaMinPx = 6;
constexpr float kExtentMax = 1.5F;  // multiple of a cell's side
/// Blur from which on a frame is sharpened: the prototypes cover less. Sharpening undoes this share of the blur, rather
/// too little than too much, as oversharpening causes ripples. The last limit is the most that it undoes, as a share of
/// a symbol's side.
constexpr float kBlurMinPx = 1.9F;
constexpr float kBlurUndone = 0.85F;
constexpr float kBlurMax = 0.2F;
/// Usual contrast of the light, in standard deviations of the noise, below which noise hides half of it.
constexpr float kFaintSigma = 18;
/// Smallest difference between a region's peak and its background, of 255 levels.
constexpr float kContrastMin = static_cast<float>(BinarizeOptions().contrast_min);

BinarizeOptions binarize_options(const PatternOptions& pattern, float scale) {
  return {.tile_px = threshold_tile_px(pattern.symbol_size_px + pattern.spacing_px, scale),
          .level = threshold_level(pattern.symbol_size_px, pattern.spacing_px, scale)};
}

}  // namespace

ShapeFinder::ShapeFinder(const PatternOptions& pattern, ExpectedFrames expected, Method binarize, Method find_regions,
                         Rules rules)
    : symbol_size_px_(static_cast<float>(pattern.symbol_size_px)),
      pitch_px_(static_cast<float>(pattern.symbol_size_px + pattern.spacing_px)),
      binarize_(binarize),
      find_regions_(find_regions),
      rules_(rules),
      expected_(std::move(expected)),
      binarizer_(binarize_options(pattern, expected_.in_the_middle().scale)),
      separator_({.tile_px = binarizer_.options().tile_px}) {
  const float scale = expected_.in_the_middle().scale;
  meters_.emplace_back(margin_px(pattern.spacing_px, scale), 2 * pitch_px_ * scale);
}

GreyView ShapeFinder::binarize(const GreyView& frame, double full, Executor& executor,
                               const std::optional<FrameNoise>& noise) {
  frame_levels_ = static_cast<float>(full / 255);
  if (binarize_ == Method::kPaper) {
    mask_ = binarize_paper(frame);
    noise_ = measure_noise(frame, full);
    return frame;
  }
  binarizer_.binarize(frame, full, noise, mask_, executor);
  noise_ = binarizer_.noise();
  edge_blur_px_ = binarizer_.edge_blur_px();
  if (edge_blur_px_ >= kBlurMinPx) return binarize_blurred(frame, full, executor);
  // A frame without contrast is empty, unless the reader knows that noise may hide the whole pattern.
  const float contrast_sigma = binarizer_.usual_contrast_sigma();
  const bool is_faint = contrast_sigma > 0 ? contrast_sigma < kFaintSigma : noise.has_value();
  return is_faint ? binarize_faint(frame, full, executor) : frame;
}

GreyView ShapeFinder::binarize_blurred(const GreyView& frame, double full, Executor& executor) {
  const float symbol_px = symbol_size_px_ * expected_.in_the_middle().scale;
  const float undone_px = std::min(kBlurUndone * edge_blur_px_, kBlurMax * symbol_px);
  const GreyView sharp = sharpener_.sharpen(frame, undone_px, full).view();
  frame_levels_ = kSharpenedFull / 255;
  binarizer_.binarize(sharp, kSharpenedFull, mask_, executor);
  noise_ = binarizer_.noise();
  return sharp;
}

/// Smooths and binarizes a faint frame. The remaining noise is correlated between pixels: stages that sum over a symbol
/// get all of it; the mask alone gets less.
GreyView ShapeFinder::binarize_faint(const GreyView& frame, double full, Executor& executor) {
  const GreyView smooth = sharpener_.smooth(frame, full).view();
  frame_levels_ = kSharpenedFull / 255;
  noise_ = noise_.scaled(kSharpenedFull / static_cast<float>(full));
  binarizer_.binarize(smooth, kSharpenedFull, noise_.scaled(1, kSmoothedNoise), mask_, executor);
  return smooth;
}

PixelRectangle ShapeFinder::part() const {
  return part_.value_or(PixelRectangle{0, 0, mask_.width(), mask_.height()});
}

void ShapeFinder::find_regions(const GreyView& frame, Executor& executor) {
  if (part_) mask_.keep(part_->left, part_->top, part_->right, part_->bottom);
  region_finder_.find(mask_, regions_, executor);
  if (find_regions_ == Method::kPaper) return;
  separator_.separate_all(
      frame, std::max(binarizer_.contrast_min(0), kContrastMin * frame_levels_), regions_,
      [this](const Region& region) { return is_too_large(region, scale_at(region)); }, executor);
}

float ShapeFinder::scale_at(const Region& region) const {
  const Eigen::Vector2f middle = region.middle_px();
  return expected_.at(middle.x(), middle.y()).scale;
}

bool ShapeFinder::is_too_large(const Region& region, float scale) const {
  const float pitch_px = pitch_px_ * scale;
  const float extent = static_cast<float>(std::max(region.width_px(), region.height_px()));
  return static_cast<float>(region.area_px) > kAreaMax * pitch_px * pitch_px || extent > kExtentMax * pitch_px;
}

DecodeRule ShapeFinder::judge_size(const Region& region) const {
  const PixelRectangle seen = part();
  const bool at_border = region.left == seen.left || region.top == seen.top || region.right == seen.right - 1 ||
                         region.bottom == seen.bottom - 1;
  if (rules_.apply(DecodeRule::kTouchesBorder, at_border)) return DecodeRule::kTouchesBorder;
  const float scale = scale_at(region), symbol_px = symbol_size_px_ * scale;
  const bool small =
      region.area_px < kAreaMinPx || static_cast<float>(region.area_px) < kAreaMin * symbol_px * symbol_px;
  if (rules_.apply(DecodeRule::kTooSmall, small)) return DecodeRule::kTooSmall;
  return is_too_large(region, scale) ? DecodeRule::kTooLarge : DecodeRule::kNoNeighbour;
}

void ShapeFinder::describe(const GreyView& frame, Executor& executor, Sightings& seen) {
  rule_.resize(regions_.regions.size());
  seen.clear();
  for (std::size_t i = 0; i < regions_.regions.size(); ++i) {
    rule_[i] = judge_size(regions_.regions[i]);
    if (rule_[i] == DecodeRule::kNoNeighbour) seen.region.push_back(static_cast<std::int32_t>(i));
  }
  const std::size_t workers = executor.workers();
  while (meters_.size() < workers) meters_.push_back(meters_.front().another());
  seen.moments.resize(seen.region.size());
  executor.run_ranges(seen.region.size(), [&](std::size_t first, std::size_t last, int worker) {
    const auto of_these = [&](auto& all) { return std::span(all).subspan(first, last - first); };
    std::visit(
        [&](const auto& view) {
          meters_[worker].measure_all(view, regions_, of_these(seen.region), of_these(seen.moments));
        },
        frame);
  });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < seen.region.size(); ++i) {
    const GreyMoments& moments = seen.moments[i];
    const bool is_faint = moments.peak - moments.background < kContrastMin * frame_levels_;
    if (moments.weight <= 0 || rules_.apply(DecodeRule::kLowContrast, is_faint)) {
      rule_[seen.region[i]] = DecodeRule::kLowContrast;
      continue;
    }
    seen.region[kept] = seen.region[i], seen.moments[kept] = moments;
    ++kept;
  }
  seen.region.resize(kept), seen.moments.resize(kept);
}

}  // namespace slsd
