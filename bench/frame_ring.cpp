// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "bench/frame_ring.hpp"

#include <cstdint>

#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

Pattern default_pattern(int symbol_size_px) {
  PatternOptions options;
  options.symbol_size_px = symbol_size_px;
  return make_pattern(options).value();
}

Surface pose(std::size_t i) {
  const double step = static_cast<double>(i);
  return plane({0, 0, 1950 + 12 * step}, {0.02 * step - 0.07, 0.05 - 0.015 * step, -1});
}

}  // namespace

FrameRing::FrameRing(int symbol_size_px) : pattern_(default_pattern(symbol_size_px)), calibration_(paper_rig()) {
  const Grey8 image = draw_pattern(pattern_);
  SimulationOptions options;
  for (std::size_t i = 0; i < kRingFrames; ++i) {
    options.seed = static_cast<std::uint32_t>(i + 1);
    frames_.push_back(simulate(image, calibration_, pose(i), options));
  }
}

}  // namespace slsd
