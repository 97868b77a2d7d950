// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/grid/lattice_frame.hpp"

#include <utility>

#include <gtest/gtest.h>

namespace slsd {
namespace {

// A plane that is turned away to the right: the scale falls by half from the left edge to the right.
ExpectedFrames turned_away(int width, int height) {
  Eigen::Matrix3d camera_from_projector = Eigen::Matrix3d::Identity();
  camera_from_projector(2, 0) = 0.5 / width;
  return {camera_from_projector, width, height};
}

TEST(ExpectedFrames, InTheMiddleIsThatOfTheMiddle) {
  for (const auto& [width, height] :
       {std::pair(1280, 1024), std::pair(640, 480), std::pair(1280, 720), std::pair(1600, 1200), std::pair(20, 20)}) {
    const ExpectedFrames frames = turned_away(width, height);
    const float middle = frames.at(0.5F * static_cast<float>(width), 0.5F * static_cast<float>(height)).scale;
    EXPECT_NEAR(frames.in_the_middle().scale, middle, 0.01 * middle) << width << 'x' << height;
  }
}

}  // namespace
}  // namespace slsd
