// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <opencv2/core/mat.hpp>

#include "core/image.hpp"

namespace slsd {

/// The least that a decoder made of OpenCV's parts does: a local threshold, and labelled regions with their moments.
/// All times are given as ratios to this one.
/// @thread thread-bound: keeps its buffers
class OpencvAnchor {
 public:
  /// @return the number of regions
  int run(const ImageView<std::uint8_t>& frame);

 private:
  cv::Mat mask_, labels_, statistics_, centroids_;
};

}  // namespace slsd
