// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <random>

#include "core/cloud/cloud.hpp"

namespace slsd {

/// A cloud with points on about half of its cells, from two cameras; a third of the seeds give colours.
inline Cloud any_cloud(std::uint32_t seed, int columns, int rows) {
  std::mt19937 random(seed);
  const auto draw = [&random](double low, double high) {
    return static_cast<float>(low + (high - low) * static_cast<double>(random()) / 4294967296.0);
  };
  Cloud cloud;
  cloud.lattice_columns = columns;
  cloud.lattice_rows = rows;
  cloud.cameras = 2;
  cloud.scan_id = "scan-" + std::to_string(seed);
  cloud.time = "2026-03-01T12:00:00.000Z";
  cloud.frame = random();
  cloud.coloured = seed % 3 == 0;
  if (seed % 2 == 1) cloud.sigma_calibration_mm = draw(0, 2);
  for (int cell = 0; cell < columns * rows * 2; ++cell) {
    if (random() % 2 == 0) continue;
    CloudPoint point{draw(-500, 500),
                     draw(-400, 400),
                     draw(400, 2500),
                     draw(0, 1600),
                     draw(0, 1200),
                     draw(0, 1280),
                     draw(0, 800),
                     draw(0, 1),
                     0,
                     0,
                     0,
                     0,
                     0};
    point.column = static_cast<std::uint16_t>(cell % columns);
    point.row = static_cast<std::uint16_t>(cell / columns % rows);
    point.camera = static_cast<std::uint8_t>(cell / columns / rows);
    point.symbol = static_cast<std::uint8_t>(1 + random() % 25);
    point.intensity = static_cast<std::uint8_t>(random() % 256);
    if (cloud.coloured)
      for (std::uint8_t& level : point.colour) level = static_cast<std::uint8_t>(random() % 256);
    cloud.points.push_back(point);
  }
  return cloud;
}

}  // namespace slsd
