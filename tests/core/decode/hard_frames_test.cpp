// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// Frames in which symbols run together or there are none.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "tests/core/decode/decoded_scene.hpp"
#include "tests/core/decode/shipped_pattern.hpp"

namespace slsd {
namespace {

using test::decode;
using test::decoder_of;
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

}  // namespace
}  // namespace slsd
