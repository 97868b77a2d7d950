// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/background.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace slsd::model {
namespace {

constexpr int kBesidePx = 2;
/// Gate for the difference of two depths: a share of 3e-5 of the background's pixels lies farther in front.
constexpr float kSigmas = 4;

/// Gives each pixel what the nearest of the pixels beside it measured, along one axis.
/// @param step  from one pixel to the next; `count` of them follow one another in each of `lines`, `apart` apart
void take_nearest(RangeImage& image, std::ptrdiff_t step, int count, std::ptrdiff_t apart, int lines) {
  const std::vector<float> depth_mm = image.depth_mm, sigma_mm = image.sigma_mm;
  for (int line = 0; line < lines; ++line) {
    for (int i = 0; i < count; ++i) {
      const auto at = static_cast<std::size_t>(line * apart + i * step);
      for (int j = std::max(0, i - kBesidePx); j <= std::min(count - 1, i + kBesidePx); ++j) {
        const auto other = static_cast<std::size_t>(line * apart + j * step);
        if (image.depth_mm[at] <= depth_mm[other] || std::isnan(depth_mm[other])) continue;
        image.depth_mm[at] = depth_mm[other], image.sigma_mm[at] = sigma_mm[other];
      }
    }
  }
}

/// Tells whether a pixel of an image sees the background, or what lies behind it.
bool sees(const RangeImage& image, int x, int y, const RangeImage& background) {
  const int u = image.left + x - background.left, v = image.top + y - background.top;
  if (u < 0 || v < 0 || u >= background.width || v >= background.height) return false;
  const std::size_t here = image.index(x, y), there = background.index(u, v);
  const float in_front_mm = background.depth_mm[there] - image.depth_mm[here];  // NaN compares as false
  const float sigma_mm = image.sigma_mm[here], of_background_mm = background.sigma_mm[there];
  return in_front_mm <= 0 ||
         in_front_mm * in_front_mm < kSigmas * kSigmas * (sigma_mm * sigma_mm + of_background_mm * of_background_mm);
}

}  // namespace

Result<Background> Background::of(std::span<const DensePoint> points, const Calibration& calibration) {
  if (points.empty()) return fail(ErrorCode::kMalformed, "the background's cloud has no points");
  auto images = range_images(points, calibration, std::nullopt);
  if (!images) return tl::unexpected(images.error());
  Background background;
  background.images_ = std::move(*images);
  for (RangeImage& image : background.images_) {
    take_nearest(image, 1, image.width, image.width, image.height);
    take_nearest(image, image.width, image.height, 1, image.width);
  }
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
