// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/paper/binarize.hpp"

#include <algorithm>
#include <random>

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>
#include <opencv2/imgproc.hpp>

namespace slsd {
namespace {

// Grey values around two levels.
cv::Mat1b two_levels(std::uint32_t seed) {
  std::mt19937 random(seed);
  const int dark = static_cast<int>(random() % 100), lit = dark + 20 + static_cast<int>(random() % 100);
  std::normal_distribution<double> noise(0, 1 + static_cast<double>(random() % 10));
  cv::Mat1b image(30, 40);
  for (auto& value : image) {
    value = static_cast<std::uint8_t>(std::clamp((random() % 3 == 0 ? lit : dark) + noise(random), 0., 255.));
  }
  return image;
}

RC_GTEST_PROP(OtsuThreshold, EqualsOpenCvs, ()) {
  const cv::Mat1b image = two_levels(*rc::gen::arbitrary<std::uint32_t>());
  Histogram histogram{};
  for (const std::uint8_t value : image) ++histogram[value];
  cv::Mat1b ignored;
  RC_ASSERT(otsu_threshold(histogram) == cv::threshold(image, ignored, 0, 255, cv::THRESH_OTSU));
}

TEST(OtsuThreshold, OfOneValueIsZero) {
  Histogram histogram{};
  histogram[77] = 100;
  EXPECT_EQ(otsu_threshold(histogram), 0);
}

RC_GTEST_PROP(BinarizePaper, RemovesNoiseAsOpenCvsMedian, ()) {
  const cv::Mat1b image = two_levels(*rc::gen::arbitrary<std::uint32_t>());
  // Stretched already: the ends of the histogram are 0 and 255.
  cv::Mat1b stretched;
  cv::normalize(image, stretched, 0, 255, cv::NORM_MINMAX);
  stretched.rowRange(0, 1) = 0;
  stretched.rowRange(1, 2) = 255;
  cv::Mat1b expected;
  cv::medianBlur(stretched, expected, 3);
  cv::threshold(expected, expected, 0, 255, cv::THRESH_OTSU);
  const auto view = [](const cv::Mat1b& of) { return ImageView<std::uint8_t>{of.data, of.cols, of.rows, of.cols}; };
  RC_ASSERT(binarize_paper(view(stretched)) == Mask(view(expected)));
}

TEST(BinarizePaper, OfSixteenBitsIsThatOfEight) {
  const cv::Mat1b image = two_levels(7);
  const Grey8 grey = [&] {
    Grey8 copy(image.cols, image.rows);
    std::copy(image.begin(), image.end(), copy.data());
    return copy;
  }();
  Grey16 deep(image.cols, image.rows);
  std::transform(image.begin(), image.end(), deep.data(), [](std::uint8_t v) { return std::uint16_t(v * 16); });
  EXPECT_EQ(binarize_paper(grey.view()), binarize_paper(deep.view()));
}

TEST(BinarizePaper, AFrameOfOneValueIsAllDark) {
  for (const int value : {0, 128, 255}) {
    const Mask mask = binarize_paper(Grey8(20, 10, static_cast<std::uint8_t>(value)).view());
    EXPECT_EQ(mask, Mask(20, 10)) << value;
  }
}

}  // namespace
}  // namespace slsd
