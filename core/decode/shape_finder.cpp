// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/shape_finder.hpp"

#include <algorithm>
#include <cmath>

#include "core/decode/paper/binarize.hpp"
#include "core/decode/prototypes.hpp"

namespace slsd {
namespace {

/// Least and greatest area of a region, as a share of a symbol's square and of a cell.
constexpr float kAreaMin = 0.08F;
constexpr float kAreaMax = 1.1F;
constexpr int kAreaMinPx = 6;
constexpr float kExtentMax = 1.5F;  // of a cell's side
/// Levels between a merged region's dark and light at which it is taken apart.
constexpr float kSplitLevels[] = {0.35F, 0.6F};
/// What is larger than this is not a few symbols that ran together.
constexpr int kSplitAreaMaxPx = 20000;
/// Between a region's peak and its background, of 255 levels.
constexpr float kContrastMin = 8;

BinarizeOptions binarize_options(const PatternOptions& pattern, float scale) {
  const float pitch = static_cast<float>(pattern.symbol_size_px + pattern.spacing_px) * scale;
  return {.tile_px = std::clamp(static_cast<int>(std::lround(0.5F * pitch)), 4, 64),
          .level = threshold_level(pattern.spacing_px, scale)};
}

}  // namespace

ShapeFinder::ShapeFinder(const PatternOptions& pattern, ExpectedFrames expected, Method binarize, Method find_regions)
    : symbol_size_px_(static_cast<float>(pattern.symbol_size_px)),
      pitch_px_(static_cast<float>(pattern.symbol_size_px + pattern.spacing_px)),
      binarize_(binarize),
      find_regions_(find_regions),
      expected_(std::move(expected)),
      binarizer_(binarize_options(pattern, expected_.in_the_middle().scale)),
      meter_(margin_px(pattern.spacing_px, expected_.in_the_middle().scale)) {}

void ShapeFinder::binarize(const GreyView& frame, double full) {
  frame_levels_ = static_cast<float>(full / 255);
  if (binarize_ == Method::kPaper) {
    mask_ = binarize_paper(frame);
  } else {
    binarizer_.binarize(frame, full, mask_);
  }
}

void ShapeFinder::find_regions(const GreyView& frame) {
  region_finder_.find(mask_, regions_);
  if (find_regions_ == Method::kPaper) return;
  splitter_.split_all(frame, kSplitLevels, regions_, [this](const Region& region) {
    return region.area_px <= kSplitAreaMaxPx && judge_size(region) == RegionStatus::kTooLarge;
  });
}

RegionStatus ShapeFinder::judge_size(const Region& region) const {
  if (region.left == 0 || region.top == 0 || region.right == mask_.width() - 1 || region.bottom == mask_.height() - 1) {
    return RegionStatus::kTouchesBorder;
  }
  const Eigen::Vector2f middle = region.middle_px();
  const float scale = expected_.at(middle.x(), middle.y()).scale, square_px = scale * scale;
  const float area = static_cast<float>(region.area_px);
  if (region.area_px < kAreaMinPx || area < kAreaMin * symbol_size_px_ * symbol_size_px_ * square_px) {
    return RegionStatus::kTooSmall;
  }
  const float extent = static_cast<float>(std::max(region.width_px(), region.height_px()));
  const bool too_large = area > kAreaMax * pitch_px_ * pitch_px_ * square_px || extent > kExtentMax * pitch_px_ * scale;
  return too_large ? RegionStatus::kTooLarge : RegionStatus::kNoNeighbour;
}

void ShapeFinder::describe(const GreyView& frame, Sightings& seen) {
  status_.resize(regions_.regions.size());
  seen.clear();
  for (std::size_t i = 0; i < regions_.regions.size(); ++i) {
    const Region& region = regions_.regions[i];
    status_[i] = judge_size(region);
    if (status_[i] != RegionStatus::kNoNeighbour) continue;
    const GreyMoments moments =
        std::visit([&](const auto& view) { return meter_.measure(view, region, regions_.runs_of(region)); }, frame);
    if (moments.weight <= 0 || moments.peak - moments.background < kContrastMin * frame_levels_) {
      status_[i] = RegionStatus::kLowContrast;
      continue;
    }
    seen.region.push_back(static_cast<std::int32_t>(i));
    seen.moments.push_back(moments);
  }
}

}  // namespace slsd
