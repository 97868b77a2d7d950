// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/regions/shape_finder.hpp"

#include <variant>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "core/code/pattern.hpp"
#include "tests/core/decode/alone.hpp"
#include "tests/core/decode/shipped_pattern.hpp"

namespace slsd {
namespace {

// Of more the ripples would be what is seen.
TEST(ShapeFinder, UndoesNoMoreBlurThanAFifthOfASymbol) {
  constexpr float kSymbolPx = 8, kScale = 1;
  const Pattern pattern = shipped_pattern("8px-6.toml");
  Grey8 frame = draw_pattern(pattern);
  cv::Mat1b image(frame.height(), frame.width(), frame.data());
  cv::GaussianBlur(image, image, {}, 2.4);
  ShapeFinder finder(pattern.options, {Eigen::Matrix3d::Identity(), frame.width(), frame.height()}, Method::kDefault,
                     Method::kDefault);
  ASSERT_NEAR(finder.expected().in_the_middle().scale, kScale, 1e-4F);
  const GreyView seen = finder.binarize(frame.view(), 255, alone);
  const auto* const sharp = std::get_if<ImageView<std::uint16_t>>(&seen);
  ASSERT_NE(sharp, nullptr) << "a frame out of focus is sharpened";
  Sharpener sharpener;
  const auto off_levels = [&](float blur_px) {
    const Grey16& expected = sharpener.sharpen(frame.view(), blur_px, 255);
    const cv::Mat is(sharp->height, sharp->width, CV_16U, const_cast<std::uint16_t*>(sharp->pixels),
                     static_cast<std::size_t>(sharp->stride) * sizeof(std::uint16_t));
    const cv::Mat should(expected.height(), expected.width(), CV_16U, const_cast<std::uint16_t*>(expected.data()));
    return cv::norm(is, should, cv::NORM_INF);
  };
  EXPECT_LE(off_levels(0.2F * kSymbolPx * kScale), 2);
  EXPECT_GT(off_levels(0.85F * 2.4F), 500);
}

// Empty frames are what most scans of a dark room see, and smoothing takes several times as long as all the rest.
TEST(ShapeFinder, SmoothsAnEmptyFrameOnlyForAReaderWhoKnowsItsNoise) {
  const Pattern pattern = *make_pattern({});
  const Grey8 black(640, 480, 3);
  ShapeFinder finder(pattern.options, {Eigen::Matrix3d::Identity(), black.width(), black.height()}, Method::kDefault,
                     Method::kDefault);
  const GreyView frame = black.view();
  EXPECT_EQ(finder.binarize(frame, 255, alone).index(), frame.index());
  EXPECT_NE(finder.binarize(frame, 255, alone, FrameNoise{1, 0}).index(), frame.index());
}

}  // namespace
}  // namespace slsd
