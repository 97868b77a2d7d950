// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// Frames in which symbols run together or there are none.
#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "core/decode/decoder.hpp"
#include "tests/core/decode/decoded_scene.hpp"
#include "tests/core/decode/images.hpp"
#include "tests/core/decode/shipped_pattern.hpp"

namespace slsd {
namespace {

using test::decode;
using test::decoder_of;
using test::frame_of;
using test::wrong_points;

/// A board of 600 x 460 mm that faces the camera, nothing behind it.
std::optional<double> board(const Ray& ray) {
  const auto hit = test::kPlane(ray);
  if (!hit) return std::nullopt;
  const Eigen::Vector3d point = ray.origin + *hit * ray.direction;
  return std::abs(point.x()) < 300 && std::abs(point.y()) < 230 ? hit : std::nullopt;
}

bool sees_board(int x, int y, const Lens& lens) {
  return board({Eigen::Vector3d::Zero(), lens.undistort({x, y}).homogeneous()}).has_value();
}

/// The board under light of the room, which what is behind it does not get.
Grey8 lit_board(const Pattern& pattern, int ambient) {
  Grey8 frame = simulate(draw_pattern(pattern), paper_rig(), board, {.dark = 10, .lit = 110});
  const Calibration rig = paper_rig();
  for (int y = 0; y < frame.height(); ++y) {
    for (int x = 0; x < frame.width(); ++x) {
      if (sees_board(x, y, rig.cameras[0].lens))
        frame.at(x, y) = static_cast<std::uint8_t>(std::min(255, frame.at(x, y) + ambient));
    }
  }
  return frame;
}

/// Symbols that lie whole on the board.
std::size_t whole_on_board(const Pattern& pattern) {
  const Calibration rig = paper_rig();
  const double half = 0.5 * pattern.options.symbol_size_px;
  std::size_t count = 0;
  for (int row = 0; row < pattern.whole_rows(); ++row) {
    for (int column = 0; column < pattern.whole_columns(); ++column) {
      bool whole = true;
      for (const double u : {-half, half}) {
        for (const double v : {-half, half}) {
          const Eigen::Vector2d corner(pattern.symbol_centre_u_px(column) + u, pattern.symbol_centre_v_px(row) + v);
          whole = whole && camera_from_projector(corner, rig, board);
        }
      }
      count += whole;
    }
  }
  return count;
}

TEST(HardFrames, ReadsALitObjectBeforeADarkBackgroundToItsEdge) {
  const Pattern pattern = shipped_pattern("16px-5.toml");
  const Grey8 frame = lit_board(pattern, 120);
  Decoder decoder = decoder_of(pattern);
  const Decoding decoding = decode(decoder, frame.view());
  const auto whole = static_cast<double>(whole_on_board(pattern));
  ASSERT_GT(whole, 1000);
  EXPECT_GE(static_cast<double>(decoding.points.size()), 0.99 * whole);
  EXPECT_EQ(wrong_points(decoding, board, 3), 0);
  // The same as ten bits.
  Grey16 deep(frame.width(), frame.height());
  std::transform(frame.data(), frame.data() + frame.size(), deep.data(), [](std::uint8_t grey) { return 4 * grey; });
  EXPECT_GE(static_cast<double>((*decoder.decode(deep.view(), 1020))->points.size()), 0.99 * whole);
}

// The object's light reaches the edge of the frame, and what runs together with it.
TEST(HardFrames, ReadsALitObjectThatTheFrameCuts) {
  const Pattern pattern = shipped_pattern("16px-5.toml");
  Grey8 frame = lit_board(pattern, 120);
  const Calibration rig = paper_rig();
  // A bar as bright as the board's gaps, from its middle to the frame's lower edge.
  for (int y = 600; y < frame.height(); ++y) {
    for (int x = 780; x < 820; ++x) {
      if (!sees_board(x, y, rig.cameras[0].lens)) frame.at(x, y) = 130;
    }
  }
  Decoder decoder = decoder_of(pattern);
  EXPECT_GE(static_cast<double>(decode(decoder, frame.view()).points.size()),
            0.985 * static_cast<double>(whole_on_board(pattern)));
}

// Six levels of 255 between light and dark, as where light has fallen to a twentieth: faint, and far above the noise.
TEST(HardFrames, ReadsWhatIsFaintlyLit) {
  const Pattern pattern = shipped_pattern("16px-5.toml");
  Decoder decoder = decoder_of(pattern);
  const std::size_t well_lit = decode(decoder, frame_of(pattern, test::kTilted).view()).points.size();
  const Grey8 faint =
      simulate(draw_pattern(pattern), paper_rig(), test::kTilted, {.dark = 4, .lit = 10.5, .noise_sigma = 0.4});
  const Decoding decoding = decode(decoder, faint.view());
  EXPECT_GE(static_cast<double>(decoding.points.size()), 0.98 * static_cast<double>(well_lit));
  EXPECT_EQ(wrong_points(decoding, test::kTilted, 3), 0);
  // Without the pattern it is a wall, with as much noise and a light that falls off.
  Grey8 wall =
      simulate(Grey8(1280, 800, 255), paper_rig(), test::kTilted, {.dark = 4, .lit = 10.5, .noise_sigma = 0.4});
  EXPECT_EQ(decode(decoder, wall.view()).points.size(), 0);
}

// Dark objects at a high gain: from pixel to pixel noise is as much as the light is.
TEST(HardFrames, ReadsWhatIsFaintInNoise) {
  const Pattern pattern = shipped_pattern("8px-6.toml");
  Decoder decoder = decoder_of(pattern);
  const std::size_t well_lit = decode(decoder, frame_of(pattern, test::kTilted).view()).points.size();
  const auto faint = [](const Grey8& image, double lit) {
    return simulate(image, paper_rig(), test::kTilted, {.dark = 15, .lit = lit, .noise_sigma = 5});
  };
  for (const double lit : {40., 60.}) {
    const Decoding decoding = decode(decoder, faint(draw_pattern(pattern), lit).view());
    EXPECT_GE(static_cast<double>(decoding.points.size()), 0.97 * static_cast<double>(well_lit)) << lit;
    EXPECT_EQ(wrong_points(decoding, test::kTilted, 5), 0) << lit;
  }
  EXPECT_EQ(decode(decoder, faint(Grey8(1280, 800, 255), 40).view()).points.size(), 0);
}

// As far out of focus as three pixels of the camera: the gaps between symbols are nearly as bright as they are.
TEST(HardFrames, ReadsAPlaneOutOfFocus) {
  const Pattern pattern = shipped_pattern("16px-5.toml");
  Decoder decoder = decoder_of(pattern);
  const std::size_t in_focus = decode(decoder, frame_of(pattern, test::kTilted).view()).points.size();
  for (const double blur_px : {2., 2.5, 3.}) {
    const Grey8 frame = simulate(draw_pattern(pattern), paper_rig(), test::kTilted, {.blur_sigma_px = blur_px});
    const Decoding decoding = decode(decoder, frame.view());
    EXPECT_GE(static_cast<double>(decoding.points.size()), 0.9 * static_cast<double>(in_focus)) << blur_px;
    EXPECT_EQ(wrong_points(decoding, test::kTilted, 3), 0) << blur_px;
    const auto deep_frame = deep(frame, 1023);
    EXPECT_GE(static_cast<double>((*decoder.decode(deep_frame.view(), 1023))->points.size()),
              0.9 * static_cast<double>(in_focus));
  }
}

// Levels are told as those of the frame, not of what was made of it.
TEST(HardFrames, IntensitiesOutOfFocusAreTheFrames) {
  constexpr double kLit = 150;
  const Pattern pattern = shipped_pattern("16px-5.toml");
  Decoder decoder = decoder_of(pattern);
  const auto middle = [&](double blur_px) {
    const Grey8 frame =
        simulate(draw_pattern(pattern), paper_rig(), test::kPlane, {.dark = 20, .lit = kLit, .blur_sigma_px = blur_px});
    std::vector<int> intensities;
    for (const CloudPoint& point : decode(decoder, frame.view()).points) intensities.push_back(point.intensity);
    std::ranges::nth_element(intensities, intensities.begin() + static_cast<std::ptrdiff_t>(intensities.size() / 2));
    return intensities.empty() ? 0 : intensities[intensities.size() / 2];
  };
  EXPECT_NEAR(middle(1), kLit, 10);  // narrow strokes are blurred
  EXPECT_NEAR(middle(3), middle(1), 20);
}

/// What is printed on a surface: dark and bright checks about as large as symbols, with a pitch of their own.
double print_at(int x, int y) {
  return (x / 17 + y / 13) % 2 == 0 ? 1 : 0.25;
}

Grey8 printed(Grey8 frame) {
  for (int y = 0; y < frame.height(); ++y) {
    for (int x = 0; x < frame.width(); ++x)
      frame.at(x, y) = static_cast<std::uint8_t>(std::lround(print_at(x, y) * frame.at(x, y)));
  }
  return frame;
}

// What lines of ink have left of a symbol is where it was: its centroid is not.
TEST(HardFrames, PlacesSymbolsThatLinesArePrintedOver) {
  const Pattern pattern = shipped_pattern("16px-5.toml");
  Decoder decoder = decoder_of(pattern);
  Grey8 frame = frame_of(pattern, test::kTilted);
  const std::size_t unprinted = decode(decoder, frame.view()).points.size();
  for (int y = 0; y < frame.height(); ++y) {
    for (int x = 0; x < frame.width(); ++x) {
      const bool is_ink = (2 * x + y) % 200 < 12;
      if (is_ink) frame.at(x, y) = static_cast<std::uint8_t>(std::lround(0.35 * frame.at(x, y)));
    }
  }
  const Decoding decoding = decode(decoder, frame.view());
  EXPECT_GE(static_cast<double>(decoding.points.size()), 0.93 * static_cast<double>(unprinted));
  EXPECT_LT(wrong_points(decoding, test::kTilted, 0.5), 95);
}

TEST(DecodeInLight, ReadsWhatIsPrintedOver) {
  const Pattern pattern = shipped_pattern("16px-5.toml");
  const Grey8 plain = frame_of(pattern, test::kTilted);
  const Grey8 frame = printed(plain);
  const Grey8 white = printed(simulate(Grey8(1280, 800, 255), paper_rig(), test::kTilted, {.seed = 2}));
  Decoder decoder = decoder_of(pattern);
  const std::size_t unprinted = decode(decoder, plain.view()).points.size();
  SceneLight light;
  EXPECT_LT((*decode_in_light(decoder, frame.view(), light))->points.size(), unprinted / 2);
  light.white = white.view();
  const auto decoding = decode_in_light(decoder, frame.view(), light);
  ASSERT_TRUE(decoding);
  EXPECT_GE(static_cast<double>((*decoding)->points.size()), 0.95 * static_cast<double>(unprinted));
  EXPECT_EQ(wrong_points(**decoding, test::kTilted, 3), 0);
}

// A white frame of another scene: what the pattern's frame gives by itself.
TEST(DecodeInLight, LosesNoPointByALateWhiteFrame) {
  const Pattern pattern = shipped_pattern("16px-5.toml");
  const Grey8 frame = frame_of(pattern, test::kTilted);
  const Grey8 other = frame_of(pattern, test::kCylinder);
  Decoder decoder = decoder_of(pattern);
  const auto plain = decode(decoder, frame.view()).points;
  SceneLight light;
  light.white = other.view();
  EXPECT_GE((*decode_in_light(decoder, frame.view(), light))->points.size(), plain.size());
  const Grey8 small(4, 4);
  light.white = small.view();
  EXPECT_EQ(decode_in_light(decoder, frame.view(), light).error().code, ErrorCode::kMismatch);
}

class FrameOfNothing : public testing::TestWithParam<std::pair<int, int>> {};

// Of every size that a camera may have: no point, no error, each region with its reason.
TEST_P(FrameOfNothing, GivesAnEmptyCloudWithItsReasons) {
  const auto [width, height] = GetParam();
  const Pattern pattern = shipped_pattern("16px-5.toml");
  Calibration rig = paper_rig();
  Lens& lens = rig.cameras[0].lens;
  lens.width_px = width, lens.height_px = height;
  lens.cx = 0.5 * (width - 1), lens.cy = 0.5 * (height - 1);
  auto decoder = Decoder::create(pattern, rig, 0, {});
  ASSERT_TRUE(decoder) << to_string(decoder.error());
  std::mt19937 random(7);
  for (const bool noisy : {false, true}) {
    for (const int grey : {0, 1, 90, 254, 255}) {
      Grey8 eight(width, height, static_cast<std::uint8_t>(grey));
      if (noisy)
        std::generate_n(eight.data(), eight.size(), [&] { return static_cast<std::uint8_t>(random() % (grey + 1)); });
      const Grey16 wide = sixteen_bits(eight);
      for (const GreyView& frame : {GreyView(eight.view()), GreyView(wide.view())}) {
        const auto decoding = decoder->decode(frame);
        ASSERT_TRUE(decoding) << to_string(decoding.error());
        EXPECT_TRUE((*decoding)->points.empty());
        EXPECT_EQ((*decoding)->count(RegionStatus::kDecoded), 0U);
        std::size_t counted = 0;
        for (const auto count : (*decoding)->counts) counted += count;
        EXPECT_EQ(counted, (*decoding)->regions.size());
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, FrameOfNothing,
                         testing::Values(std::pair(1, 1), std::pair(2, 1), std::pair(1, 3), std::pair(5, 7),
                                         std::pair(32767, 1), std::pair(1, 32767), std::pair(64, 64),
                                         std::pair(1600, 1200)));

}  // namespace
}  // namespace slsd
