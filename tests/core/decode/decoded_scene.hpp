// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <utility>

#include <gtest/gtest.h>

#include "core/decode/decoder.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd::test {

inline const Surface kPlane = plane({0, 0, 2000}, {0, 0, 1});
inline const Surface kTilted = plane({0, 0, 2000}, {0.4, 0.15, -1});
inline const Surface kCylinder = cylinder({0, 0, 2000}, {0, 1, 0}, 150);

inline Grey8 frame_of(const Pattern& pattern, const Surface& surface, std::uint32_t seed = 1) {
  SimulationOptions options;
  options.seed = seed;
  return simulate(draw_pattern(pattern), paper_rig(), surface, options);
}

inline Decoder decoder_of(const Pattern& pattern, const DecodeOptions& options = {}) {
  auto decoder = Decoder::create(pattern, paper_rig(), 0, options);
  EXPECT_TRUE(decoder) << (decoder ? "" : decoder.error().message);
  return std::move(*decoder);
}

inline Decoding decode(Decoder& decoder, const GreyView& frame) {
  const auto decoding = decoder.decode(frame);
  EXPECT_TRUE(decoding);
  return **decoding;
}

/// Points whose cell is not the one that lights what the camera sees there.
inline int wrong_points(const Decoding& decoding, const Surface& surface, double tolerance_px) {
  const Calibration rig = paper_rig();
  int wrong = 0;
  for (const CloudPoint& point : decoding.points) {
    const auto truth = projector_from_camera({point.camera_u, point.camera_v}, rig, surface);
    wrong += !truth || (*truth - Eigen::Vector2d(point.projector_u, point.projector_v)).norm() > tolerance_px;
  }
  return wrong;
}

}  // namespace slsd::test
