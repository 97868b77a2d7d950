// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/pattern_reader.hpp"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include "tests/core/decode/images.hpp"

namespace slsd {
namespace {

constexpr int kWidth = 1000, kHeight = 900;

Pattern small_pattern(std::uint32_t seed = 1) {
  auto pattern = make_pattern({.projector_width_px = 640, .projector_height_px = 360, .seed = seed});
  EXPECT_TRUE(pattern);
  return *pattern;
}

/// How a pattern lies in the frame: its middle in the frame's, turned clockwise, so many camera px to a projector px.
struct Lie {
  double turn_deg = 0, scale = 1.4;
  int width = kWidth, height = kHeight;  ///< of the frame
  double blur_px = 0.8;

  [[nodiscard]] Eigen::Affine2d camera_from_projector() const {
    return Eigen::Translation2d(0.5 * width, 0.5 * height) * Eigen::Rotation2Dd(turn_deg / 180 * std::numbers::pi) *
           Eigen::Scaling(scale) * Eigen::Translation2d(-320, -180);
  }
};

Grey8 seen(const Pattern& pattern, const Lie& lie) {
  Grey8 image = draw_pattern(pattern), frame(lie.width, lie.height);
  const Eigen::Affine2d map = lie.camera_from_projector();
  const cv::Matx23d matrix(map(0, 0), map(0, 1), map(0, 2), map(1, 0), map(1, 1), map(1, 2));
  cv::Mat from(image.height(), image.width(), CV_8U, image.data()), to(lie.height, lie.width, CV_8U, frame.data());
  cv::warpAffine(from, to, matrix, to.size());
  cv::GaussianBlur(to, to, {}, lie.blur_px);
  to.convertTo(to, -1, 150.0 / 255, 20);
  return frame;
}

std::vector<SymbolMatch> read(PatternReader& reader, const GreyView& frame) {
  auto matches = reader.read(frame);
  EXPECT_TRUE(matches) << to_string(matches.error());
  return *matches;
}

/// Symbols that the frame has whole, some of them at its sides.
std::size_t visible(const Pattern& pattern, const Lie& lie) {
  std::size_t count = 0;
  const double margin = pattern.pitch_px() * lie.scale;
  for (int row = 0; row < pattern.whole_rows(); ++row) {
    for (int column = 0; column < pattern.whole_columns(); ++column) {
      const Eigen::Vector2d at = lie.camera_from_projector() *
                                 Eigen::Vector2d(pattern.symbol_centre_u_px(column), pattern.symbol_centre_v_px(row));
      count += at.x() > margin && at.y() > margin && at.x() < lie.width - margin && at.y() < lie.height - margin;
    }
  }
  return count;
}

void expect_read(const std::vector<SymbolMatch>& matches, const Pattern& pattern, const Lie& lie) {
  EXPECT_GE(static_cast<double>(matches.size()), 0.95 * static_cast<double>(visible(pattern, lie)))
      << lie.turn_deg << " deg, " << lie.scale;
  for (const SymbolMatch& match : matches) {
    EXPECT_LT((lie.camera_from_projector() * match.projector_px - match.camera_px).norm(), 0.5 * lie.scale);
  }
}

class ReadTurnedPattern : public testing::TestWithParam<int> {};

TEST_P(ReadTurnedPattern, FindsIt) {
  const Pattern pattern = small_pattern();
  const Lie lie{static_cast<double>(GetParam())};
  PatternReader reader(pattern);
  expect_read(read(reader, seen(pattern, lie).view()), pattern, lie);
}

INSTANTIATE_TEST_SUITE_P(Degrees, ReadTurnedPattern, testing::Values(0, 90, 180, 270),
                         testing::PrintToStringParamName());

TEST(ReadPatternAnywhere, FindsItAtAnyScale) {
  const Pattern pattern = small_pattern();
  for (const double scale : {0.8, 1.15, 2.0, 2.9}) {
    PatternReader reader(pattern);
    expect_read(read(reader, seen(pattern, {10, scale}).view()), pattern, {10, scale});
  }
}

// A camera of many more pixels than the projector has, and blurred by as many more.
TEST(ReadPatternAnywhere, FindsItInLargeFrames) {
  const Pattern pattern = small_pattern();
  for (const double scale : {4.3, 6.5, 9.0}) {
    const Lie lie{7, scale, 3600, 2700, 0.4 * scale};
    PatternReader reader(pattern);
    const auto matches = read(reader, seen(pattern, lie).view());
    expect_read(matches, pattern, lie);
    double squares = 0;
    for (const SymbolMatch& match : matches)
      squares += (lie.camera_from_projector() * match.projector_px - match.camera_px).squaredNorm();
    EXPECT_LT(std::sqrt(squares / static_cast<double>(matches.size())), 0.03 * scale);
  }
}

TEST(ReadPatternAnywhere, FindsItWhereverItWasBefore) {
  const Pattern pattern = small_pattern();
  PatternReader reader(pattern);
  const Lie lies[] = {{0, 1.4}, {90, 2}, {90, 2.05}, {200, 1.1}, {0, 1.4}};
  for (const Lie& lie : lies) {
    expect_read(read(reader, seen(pattern, lie).view()), pattern, lie);
    EXPECT_THAT(read(reader, Grey8(kWidth, kHeight, 30).view()), testing::IsEmpty());
    EXPECT_EQ(reader.shapes(), 0U);
  }
}

TEST(ReadPatternAnywhere, AllScalesReadOneCodebook) {
  const IndexedPattern pattern(small_pattern());
  const auto codebook = pattern.codebook();
  PatternReader reader(pattern);
  long users = codebook.use_count();
  for (const double scale : {1.1, 2.2}) {
    const Lie lie{0, scale};
    const Grey8 frame = seen(pattern.pattern(), lie);
    expect_read(read(reader, frame.view()), pattern.pattern(), lie);
    EXPECT_GT(codebook.use_count(), users);
    users = codebook.use_count();
    // What is there for a scale serves those that are nearly the same.
    const Lie nearly{0, 0.98 * scale};
    expect_read(read(reader, seen(pattern.pattern(), nearly).view()), pattern.pattern(), nearly);
    EXPECT_EQ(codebook.use_count(), users);
  }
}

TEST(ReadPatternAnywhere, ReadsAnotherScaleAsIfItWereTheFirst) {
  const Pattern pattern = small_pattern();
  const Grey8 frame = seen(pattern, {0, 2.2});
  PatternReader used(pattern), fresh(pattern);
  (void)read(used, seen(pattern, {0, 1.1}).view());
  const auto again = read(used, frame.view()), first = read(fresh, frame.view());
  ASSERT_EQ(again.size(), first.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(again[i].camera_px, first[i].camera_px);
    EXPECT_EQ(again[i].projector_px, first[i].projector_px);
  }
}

TEST(ReadPatternAnywhere, DoesNotTakeAnotherPatternForItsOwn) {
  PatternReader reader(small_pattern(2));
  const std::vector<SymbolMatch> matches = read(reader, seen(small_pattern(1), {}).view());
  EXPECT_LT(matches.size(), 12U);
  EXPECT_GT(reader.shapes(), 500U);
}

TEST(ReadPatternAnywhere, ReadsFramesOfEveryDepth) {
  const Pattern pattern = small_pattern();
  const Lie lie;
  const Grey8 frame = seen(pattern, lie);
  for (const int bits : {10, 12, 14, 16}) {
    PatternReader reader(pattern);
    expect_read(read(reader, deep(frame, (1 << bits) - 1).view()), pattern, lie);
  }
}

TEST(ReadPatternAnywhere, RefusesFramesThatAreTooLarge) {
  PatternReader reader(small_pattern());
  for (const auto& [width, height] : {std::pair(32768, 8), std::pair(8, 32768)}) {
    const auto matches = reader.read(Grey8(width, height, 200).view());
    ASSERT_FALSE(matches);
    EXPECT_EQ(matches.error().code, ErrorCode::kUnsupported);
  }
  EXPECT_TRUE(reader.read(Grey8(32767, 8, 200).view()));
}

}  // namespace
}  // namespace slsd
