// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/regions/sharpen.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace slsd {
namespace {

constexpr int kSizePx = 320;
constexpr double kMean = 120, kAmplitude = 20;

/// How much of a grating along the rows is left, and its mean, in levels of the sharpened frame.
struct Grating {
  double mean, amplitude;
};

Grating sharpen_grating(double period_px, float blur_px) {
  Grey8 frame(kSizePx, 8);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < kSizePx; ++x)
      frame.row(y)[x] =
          static_cast<std::uint8_t>(std::lround(kMean + kAmplitude * std::cos(2 * std::numbers::pi * x / period_px)));
  }
  Sharpener sharpener;
  const Grey16& sharp = sharpener.sharpen(GreyView(frame.view()), blur_px, 250);
  double sum = 0, cosine = 0;
  for (int x = kSizePx / 4; x < 3 * kSizePx / 4; ++x) {
    sum += sharp.row(4)[x];
    cosine += sharp.row(4)[x] * std::cos(2 * std::numbers::pi * x / period_px);
  }
  return {sum / (kSizePx / 2.), 2 * cosine / (kSizePx / 2.)};
}

class Sharpeners : public testing::TestWithParam<float> {};

// Wiener's filter, once more from its definition: T H / (H^2 + k^2), 1 where nothing changes.
TEST_P(Sharpeners, BringEachPeriodBackAsWienersFilterDoes) {
  constexpr double kLeftPx = 1, kNoiseShare = 0.1;
  const double blur_px = GetParam();
  const auto gain = [&](double w) {
    const double blur = std::exp(-w * w * blur_px * blur_px / 2), left = std::exp(-w * w * kLeftPx * kLeftPx / 2);
    return left * blur / (blur * blur + kNoiseShare * kNoiseShare);
  };
  for (const double period_px : {8., 10., 16., 20., 40.}) {
    const Grating grating = sharpen_grating(period_px, GetParam());
    const double per_level = kSharpenedFull / 250;
    EXPECT_NEAR(grating.mean, kMean * per_level, 0.005 * kMean * per_level) << period_px;
    const double expected = kAmplitude * per_level * gain(2 * std::numbers::pi / period_px) / gain(0);
    EXPECT_NEAR(grating.amplitude, expected, 0.055 * expected) << period_px;
  }
}

INSTANTIATE_TEST_SUITE_P(Blurs, Sharpeners, testing::Values(1.5F, 2.F, 2.5F));

TEST(Sharpener, LeavesRoomAboveWhatWasSaturated) {
  cv::Mat edge(40, 40, CV_8U, cv::Scalar(0));
  edge.colRange(20, 40) = 255;
  cv::GaussianBlur(edge, edge, {}, 2, 2, cv::BORDER_REPLICATE);
  Grey8 frame(40, 40);
  for (int y = 0; y < 40; ++y) std::copy_n(edge.ptr(y), 40, frame.row(y));
  Sharpener sharpener;
  const Grey16& sharp = sharpener.sharpen(GreyView(frame.view()), 2, 255);
  const auto [least, most] = std::minmax_element(sharp.row(20), sharp.row(20) + 40);
  EXPECT_EQ(*least, 0);
  EXPECT_GT(*most, kSharpenedFull * 1.01);
  EXPECT_LT(*most, 65535);
  EXPECT_NEAR(sharp.row(20)[39], kSharpenedFull, 0.01 * kSharpenedFull);
}

TEST(Sharpener, LeavesWhatIsSymmetricWhereItIs) {
  cv::Mat spot(61, 61, CV_8U, cv::Scalar(10));
  cv::circle(spot, {30, 30}, 9, cv::Scalar(200), cv::FILLED);
  cv::GaussianBlur(spot, spot, {}, 2.2, 2.2);
  Grey8 frame(61, 61);
  for (int y = 0; y < 61; ++y) std::copy_n(spot.ptr(y), 61, frame.row(y));
  Sharpener sharpener;
  const Grey16& sharp = sharpener.sharpen(GreyView(frame.view()), 2.2F, 255);
  for (int y = 0; y < 61; ++y) {
    for (int x = 0; x < 61; ++x) {
      EXPECT_NEAR(sharp.row(y)[x], sharp.row(60 - y)[60 - x], 2);
      EXPECT_NEAR(sharp.row(y)[x], sharp.row(x)[y], 2);
    }
  }
}

TEST(Sharpener, SmoothsAsOpenCvDoes) {
  cv::Mat frame(50, 70, CV_8U);
  cv::randu(frame, 0, 256);
  const cv::Mat weights = (cv::Mat_<float>(1, 3) << 0.25F, 0.5F, 0.25F);
  cv::Mat smooth;
  cv::sepFilter2D(frame, smooth, CV_32F, weights, weights, {-1, -1}, 0, cv::BORDER_REPLICATE);
  Grey8 grey(70, 50);
  for (int y = 0; y < 50; ++y) std::copy_n(frame.ptr(y), 70, grey.row(y));
  Sharpener sharpener;
  const Grey16& ours = sharpener.smooth(GreyView(grey.view()), 255);
  for (int y = 0; y < 50; ++y)
    for (int x = 0; x < 70; ++x) EXPECT_NEAR(ours.row(y)[x], kSharpenedFull / 255 * smooth.at<float>(y, x), 2);
}

TEST(Sharpener, SmoothingLeavesAsMuchNoiseAsItSays) {
  cv::Mat noise(400, 400, CV_16U);
  cv::randn(noise, 20000, 1000);
  Grey16 frame(400, 400);
  for (int y = 0; y < 400; ++y) std::copy_n(noise.ptr<std::uint16_t>(y), 400, frame.row(y));
  Sharpener sharpener;
  Grey16 smooth = sharpener.smooth(GreyView(frame.view()), kSharpenedFull);
  cv::Scalar mean, deviation;
  cv::meanStdDev(cv::Mat(400, 400, CV_16U, smooth.data()), mean, deviation);
  EXPECT_NEAR(deviation[0], kSmoothedNoise * 1000, 15);
}

}  // namespace
}  // namespace slsd
