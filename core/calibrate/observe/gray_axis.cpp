// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/observe/gray_axis.hpp"

#include <algorithm>
#include <cstdlib>

namespace slsd {
namespace {

/// Grey levels of 255 between a bit and its inverse for it to be certain.
constexpr int kBitContrastMin = 4;
constexpr std::size_t kLeftOutMax = 2;

}  // namespace

GrayAxis::GrayAxis(std::span<const cv::Mat> images) : images_(images), bits_(images.size() / 2) {}

int GrayAxis::contrast(std::size_t bit, const cv::Point& pixel) const {
  return images_[2 * bit].at<std::uint8_t>(pixel) - images_[2 * bit + 1].at<std::uint8_t>(pixel);
}

void GrayAxis::leave_out_unseen(std::span<const cv::Point> pixels) {
  const std::size_t all = images_.size() / 2, least = all - std::min(all, kLeftOutMax);
  const auto certain = [&](const cv::Point& pixel) { return std::abs(contrast(bits_ - 1, pixel)) >= kBitContrastMin; };
  while (bits_ > least && 2 * std::ranges::count_if(pixels, certain) < std::ssize(pixels)) --bits_;
}

std::optional<double> GrayAxis::place_px(const cv::Point& pixel) const {
  int bin = 0;
  for (std::size_t bit = 0; bit < bits_; ++bit) {
    const int difference = contrast(bit, pixel);
    if (std::abs(difference) < kBitContrastMin) return std::nullopt;
    bin = 2 * bin + ((bin & 1) ^ (difference > 0 ? 1 : 0));
  }
  return bin * bin_px() + 0.5 * (bin_px() - 1);
}

int GrayAxis::bin_px() const {
  return 1 << (images_.size() / 2 - bits_);
}

}  // namespace slsd
