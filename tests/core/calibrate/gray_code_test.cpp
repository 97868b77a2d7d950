// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/observe/gray_code.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

namespace slsd {
namespace {

constexpr ImageSize kProjector{640, 400};

/// A camera that sees two pixels for each of the projector's, shifted.
Grey8 seen(const Grey8& projected) {
  Grey8 image(1200, 700, 10);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const int u = (x + 40) / 2, v = (y + 60) / 2;
      image.at(x, y) = projected.at(u, v) > 0 ? 200 : 20;
    }
  }
  return image;
}

TEST(ReadGrayCode, TiesMeansOfSquaresToEachOther) {
  std::vector<Grey8> captured;
  for (const Grey8& image : draw_gray_code(kProjector)) captured.push_back(seen(image));
  ASSERT_EQ(captured.size(), gray_code_images(kProjector));
  const Grey8 white = seen(Grey8(640, 400, 255)), black = seen(Grey8(640, 400, 0));
  GrayCapture capture{white.view(), black.view(), {}};
  for (const Grey8& image : captured) capture.code.emplace_back(image.view());
  const auto points = read_gray_code(capture, kProjector, [](int x, int) { return x >= 100; });
  ASSERT_TRUE(points) << points.error().message;
  EXPECT_GT(points->size(), 2000U);
  for (const ProjectedPoint& point : *points) {
    EXPECT_NEAR(point.camera_px.x(), 2 * point.projector_px.x() - 40 + 0.5, 1e-6);
    EXPECT_NEAR(point.camera_px.y(), 2 * point.projector_px.y() - 60 + 0.5, 1e-6);
    EXPECT_GE(point.camera_px.x(), 100);
  }
}

/// The same by a camera of more than 8 bits, which leaves the upper ones of 16 empty.
Grey16 seen(const Grey8& projected, int full) {
  const Grey8 narrow = seen(projected);
  Grey16 image(narrow.width(), narrow.height());
  std::transform(narrow.data(), narrow.data() + narrow.size(), image.data(),
                 [&](std::uint8_t level) { return static_cast<std::uint16_t>(level * full / 255); });
  return image;
}

TEST(ReadGrayCode, ReadsLevelsOfAnyCountOfBits) {
  for (const int full : {1023, 4095, 16383, 65535}) {
    std::vector<Grey16> captured;
    for (const Grey8& image : draw_gray_code(kProjector)) captured.push_back(seen(image, full));
    const Grey16 white = seen(Grey8(640, 400, 255), full), black = seen(Grey8(640, 400, 0), full);
    GrayCapture capture{white.view(), black.view(), {}};
    for (const Grey16& image : captured) capture.code.emplace_back(image.view());
    const auto points = read_gray_code(capture, kProjector, [](int, int) { return true; });
    ASSERT_TRUE(points) << points.error().message;
    EXPECT_GT(points->size(), 2000U) << full;
  }
}

/// The same with a projector out of focus: stripes of 2 px are gone, those of 4 px faint.
Grey8 seen_blurred(const Grey8& projected) {
  constexpr int kReach = 5;
  double weights[2 * kReach + 1], sum = 0;
  for (int i = -kReach; i <= kReach; ++i) sum += weights[i + kReach] = std::exp(-0.5 * i * i / (1.9 * 1.9));
  Grey8 across(projected.width(), projected.height()), both(projected.width(), projected.height());
  const auto blur = [&](const Grey8& from, Grey8& to, int dx, int dy) {
    for (int y = 0; y < to.height(); ++y) {
      for (int x = 0; x < to.width(); ++x) {
        double value = 0;
        for (int i = -kReach; i <= kReach; ++i) {
          value += weights[i + kReach] / sum *
                   from.at(std::clamp(x + i * dx, 0, to.width() - 1), std::clamp(y + i * dy, 0, to.height() - 1));
        }
        to.at(x, y) = static_cast<std::uint8_t>(std::lround(value));
      }
    }
  };
  blur(projected, across, 1, 0);
  blur(across, both, 0, 1);
  Grey8 image(1200, 700, 10);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      image.at(x, y) = static_cast<std::uint8_t>(20 + both.at((x + 40) / 2, (y + 60) / 2) * 80 / 255);
    }
  }
  return image;
}

TEST(ReadGrayCode, DoesWithoutStripesThatAProjectorOutOfFocusBlurs) {
  std::vector<Grey8> captured;
  for (const Grey8& image : draw_gray_code(kProjector)) captured.push_back(seen_blurred(image));
  const Grey8 white = seen_blurred(Grey8(640, 400, 255)), black = seen_blurred(Grey8(640, 400, 0));
  GrayCapture capture{white.view(), black.view(), {}};
  for (const Grey8& image : captured) capture.code.emplace_back(image.view());
  const auto points = read_gray_code(capture, kProjector, [](int, int) { return true; });
  ASSERT_TRUE(points) << points.error().message;
  EXPECT_GT(points->size(), 2000U);
  for (const ProjectedPoint& point : *points) {
    EXPECT_NEAR(point.camera_px.x(), 2 * point.projector_px.x() - 40 + 0.5, 0.3);
    EXPECT_NEAR(point.camera_px.y(), 2 * point.projector_px.y() - 60 + 0.5, 0.3);
  }
}

/// What reading says of captures that something was done to.
std::string refusal(const ImageSize& projector, const std::function<void(GrayCapture&)>& spoil) {
  static const std::vector<Grey8> captured = [] {
    std::vector<Grey8> all{seen(Grey8(640, 400, 255)), seen(Grey8(640, 400, 0))};
    for (const Grey8& image : draw_gray_code(kProjector)) all.push_back(seen(image));
    return all;
  }();
  GrayCapture capture{captured[0].view(), captured[1].view(), {}};
  for (std::size_t i = 2; i < captured.size(); ++i) capture.code.emplace_back(captured[i].view());
  spoil(capture);
  const auto points = read_gray_code(capture, projector, [](int, int) { return true; });
  return points ? "" : points.error().message;
}

TEST(ReadGrayCode, SaysWhatIsInAnotherOrder) {
  EXPECT_EQ(refusal(kProjector, [](GrayCapture&) {}), "");
  EXPECT_THAT(refusal(kProjector, [](GrayCapture& capture) { std::swap(capture.white, capture.black); }),
              testing::HasSubstr("white.png is darker than black.png"));
  const auto inverse_first = [](GrayCapture& capture) {
    for (std::size_t i = 0; i < capture.code.size(); i += 2) std::swap(capture.code[i], capture.code[i + 1]);
  };
  EXPECT_THAT(refusal({1024, 512}, inverse_first), testing::HasSubstr("each followed by its inverse"));
  EXPECT_THAT(refusal(kProjector, inverse_first), testing::HasSubstr("order"));
}

TEST(ReadGrayCode, SaysThatTheProjectorIsLarger) {
  EXPECT_THAT(refusal({520, 260}, [](GrayCapture&) {}), testing::HasSubstr("reaches beyond 520x260 pixels"));
}

TEST(ReadGrayCode, RefusesTheCodeOfAnotherProjector) {
  const Grey8 image(100, 100, 0);
  const GrayCapture capture{image.view(), image.view(), {image.view(), image.view()}};
  const auto points = read_gray_code(capture, {1024, 768}, [](int, int) { return true; });
  ASSERT_FALSE(points);
  EXPECT_EQ(points.error().code, ErrorCode::kMismatch);
  EXPECT_THAT(points.error().message,
              testing::HasSubstr("the Gray code has 2 images, but 40 fit a projector of 1024x768"));
}

}  // namespace
}  // namespace slsd
