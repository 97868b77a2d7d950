// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "core/dense/dense_mapper.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd::test {

/// The paper's rig with the middle of its camera alone.
inline Calibration small_rig() {
  Calibration rig = paper_rig();
  Lens& lens = rig.cameras[0].lens;
  lens.width_px = 360, lens.height_px = 280;
  lens.cx -= 620, lens.cy -= 460;
  return rig;
}

inline Pattern small_pattern(std::uint32_t seed = 1) {
  PatternOptions options;
  options.symbol_size_px = 8, options.spacing_px = 1;
  options.symbols = {9, 10, 11, 12, 18, 19};
  options.seed = seed;
  options.method = ArrayMethod::kConstructive;
  return make_pattern(options).value();
}

inline const Pattern& pattern() {
  static const Pattern made = small_pattern();
  return made;
}

inline const Surface kTilted = plane({0, 0, 2000}, {0.3, 0.15, -1});

struct Seen {
  Calibration rig;
  Surface surface;
  Grey8 frame;
};

inline Seen see(const Surface& surface, const Grey8& image, const SimulationOptions& options = {}) {
  const Calibration rig = small_rig();
  return {rig, surface, simulate(image, rig, surface, options)};
}

/// A column in front of a wall.
inline std::optional<double> column_and_wall(const Ray& ray) {
  const auto wall = plane({0, 0, 2150}, {0, 0, 1})(ray), column = cylinder({0, 0, 2030}, {0, 1, 0}, 40)(ray);
  return column ? column : wall;
}

inline const Seen& tilted() {
  static const Seen seen = see(kTilted, draw_pattern(pattern()));
  return seen;
}

inline const Seen& column() {
  static const Seen seen = see(column_and_wall, draw_pattern(pattern()));
  return seen;
}

/// An upright lath before a wall, leaning a little, as many px wide as that: narrower than any codeword.
inline Surface lath(double width_px, double half_height_mm = 1000) {
  return [=](const Ray& ray) -> std::optional<double> {
    const auto wall = plane({0, 0, 2150}, {0, 0, 1})(ray), near = plane({0, 0, 2050}, {0.1, 0, -1})(ray);
    const Eigen::Vector3d at = ray.origin + near.value_or(0) * ray.direction;
    const double half_mm = 0.5 * width_px * 2050 / small_rig().cameras[0].lens.fx;
    const bool on_it = near && std::abs(at.x() - 0.1 * at.y()) < half_mm && std::abs(at.y()) < half_height_mm;
    return on_it ? near : wall;
  };
}

inline Grey16 sixteen_bits(const Grey8& frame) {
  Grey16 wide(frame.width(), frame.height());
  std::transform(frame.data(), frame.data() + frame.size(), wide.data(),
                 [](std::uint8_t level) { return 257 * level; });
  return wide;
}

/// A decoder that has seen no frame, without making its constant data again.
inline Decoder fresh_decoder() {
  static const Decoder first = Decoder::create(pattern(), small_rig(), 0, {}).value();
  return first.another();
}

inline DenseMapper fresh_mapper() {
  static const DenseMapper first(pattern(), small_rig(), 0, {});
  return first.another();
}

struct Measured {
  std::size_t symbols;
  DenseMap map;
};

inline Measured measure(const GreyView& frame, DenseMapper& mapper, double full = 255, Executor* executor = nullptr) {
  SerialExecutor serial;
  Decoder decoder = fresh_decoder();
  const auto decoding = decoder.decode(frame, full);
  EXPECT_TRUE(decoding);
  const DecodedSymbols symbols = decoder.symbols();
  return {symbols.lattice->symbols.size(),
          mapper.measure(frame, full, symbols, executor != nullptr ? *executor : serial)};
}

inline Measured measure(const GreyView& frame, double full = 255) {
  DenseMapper mapper = fresh_mapper();
  return measure(frame, mapper, full);
}

inline Measured measure_by(const DenseOptions& options, const GreyView& frame) {
  DecodeOptions decode;
  decode.dense = options;
  DenseMapper mapper(pattern(), small_rig(), 0, decode);
  return measure(frame, mapper);
}

/// Points that were measured nearer than that.
inline DenseMap nearer_than(float depth_mm, DenseMap map) {
  for (std::size_t pixel = 0; pixel < map.pixels.size(); ++pixel)
    if (map.measured(pixel) && map.depth_mm[pixel] > depth_mm) map.drop(pixel, DensePixel::kNotReached);
  map.count_pixels();
  return map;
}

inline bool same(const DenseMap& a, const DenseMap& b) {
  const auto equal = [](const auto& one, const auto& other) {
    return one.size() == other.size() && std::memcmp(one.data(), other.data(), one.size() * sizeof one[0]) == 0;
  };
  return equal(a.depth_mm, b.depth_mm) && equal(a.sigma_mm, b.sigma_mm) && equal(a.intensity, b.intensity) &&
         equal(a.pixels, b.pixels);
}

struct Score {
  std::size_t lit = 0, measured = 0, unlit = 0, gross = 0, beyond_three = 0;
  double median_px = 0, rms_mm = 0, over_sigma = 0;
};

inline Score score(const DenseMap& map, const Seen& seen) {
  const Lens& lens = seen.rig.cameras[0].lens;
  Score score;
  std::vector<double> px;
  double squares = 0, squares_sigma = 0;
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      const std::size_t pixel = static_cast<std::size_t>(y) * map.width + x;
      const Eigen::Vector3d ray = lens.undistort({x, y}).homogeneous();
      const bool lit = projector_from_camera({x, y}, seen.rig, seen.surface).has_value();
      score.lit += lit;
      if (!map.measured(pixel)) continue;
      if (!lit) {
        ++score.unlit;
        continue;
      }
      ++score.measured;
      const double off = static_cast<double>(map.depth_mm[pixel]) - *seen.surface({Eigen::Vector3d::Zero(), ray});
      if (std::abs(off) > 5) {
        ++score.gross;
        continue;
      }
      px.push_back(std::abs(off) / 6.3);
      squares += off * off;
      const double over = off / static_cast<double>(map.sigma_mm[pixel]);
      squares_sigma += over * over;
      score.beyond_three += std::abs(over) > 3;
    }
  }
  if (px.empty()) return score;
  std::nth_element(px.begin(), px.begin() + static_cast<std::ptrdiff_t>(px.size() / 2), px.end());
  score.median_px = px[px.size() / 2];
  score.rms_mm = std::sqrt(squares / static_cast<double>(px.size()));
  score.over_sigma = std::sqrt(squares_sigma / static_cast<double>(px.size()));
  return score;
}

inline double share(std::size_t part, std::size_t all) {
  return static_cast<double>(part) / static_cast<double>(std::max<std::size_t>(1, all));
}

}  // namespace slsd::test
