// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "bench/opencv_anchor.hpp"

#include <opencv2/imgproc.hpp>

namespace slsd {
namespace {

constexpr int kBlockPx = 41;
// A pixel is lit that exceeds the mean around it by this: without it the noise of dark places would be regions too, and
// the anchor slower.
constexpr double kOffset = -10;

}  // namespace

int OpencvAnchor::run(const ImageView<std::uint8_t>& frame) {
  const cv::Mat1b image(frame.height, frame.width, const_cast<std::uint8_t*>(frame.pixels),
                        static_cast<std::size_t>(frame.stride));
  cv::adaptiveThreshold(image, mask_, 255, cv::ADAPTIVE_THRESH_MEAN_C, cv::THRESH_BINARY, kBlockPx, kOffset);
  return cv::connectedComponentsWithStats(mask_, labels_, statistics_, centroids_) - 1;
}

}  // namespace slsd
