// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/background.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace slsd::model {
namespace {

constexpr int kBesidePx = 2;
/// Gate for the difference of two depths: a share of 3e-5 of the background's pixels lies farther in front.
constexpr float kSigmas = 4;

/// Tells whether a depth lies on what a pixel of the background measured, or behind it.
bool lies_on(float depth_mm, float sigma_mm, const RangeImage& background, std::size_t pixel) {
  const float nearest = background.depth_mm[pixel];  // NaN compares as false
  return depth_mm > nearest - kSigmas * std::hypot(sigma_mm, background.sigma_mm[pixel]);
}

bool sees(const RangeImage& image, int x, int y, const RangeImage& background) {
  const float depth_mm = image.depth_mm[image.index(x, y)], sigma_mm = image.sigma_mm[image.index(x, y)];
  const int u = image.left + x - background.left, v = image.top + y - background.top;
  for (int row = std::max(0, v - kBesidePx); row <= std::min(background.height - 1, v + kBesidePx); ++row)
    for (int column = std::max(0, u - kBesidePx); column <= std::min(background.width - 1, u + kBesidePx); ++column)
      if (lies_on(depth_mm, sigma_mm, background, background.index(column, row))) return true;
  return false;
}

}  // namespace

Result<Background> Background::of(std::span<const DensePoint> points, const Calibration& calibration) {
  if (points.empty()) return fail(ErrorCode::kMalformed, "the background's cloud has no points");
  auto images = range_images(points, calibration, std::nullopt);
  if (!images) return tl::unexpected(images.error());
  Background background;
  background.images_ = std::move(*images);
  return background;
}

void Background::remove_from(std::vector<RangeImage>& images) const {
  for (RangeImage& image : images) {
    const auto background = std::ranges::find(images_, image.camera, &RangeImage::camera);
    if (background == images_.end()) continue;
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x)
        if (sees(image, x, y, *background)) image.depth_mm[image.index(x, y)] = std::numeric_limits<float>::quiet_NaN();
    image.trim();
  }
  std::erase_if(images, [](const RangeImage& image) { return image.depth_mm.empty(); });
}

}  // namespace slsd::model
