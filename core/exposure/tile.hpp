// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <vector>

#include "core/image.hpp"

namespace slsd {

inline constexpr int kTilePx = 64;

/// Levels of the pattern in a tile of a frame, as in LightLevels.
struct TileLevels {
  double dark = 0;
  double lit = 0;
  double edge_px = 0;
  double period_px = 0;
};

/// One tile's pixels in floating point; the buffer is reused for the next tile.
/// @thread thread-bound
class Tile {
 public:
  /// Loads the tile with its first pixel at (left, top), which lies inside the frame.
  void take(const GreyView& frame, int left, int top);

  /// Measures the levels; empty if no pattern is visible: too little contrast, fewer edges than symbols have, or as
  /// many as noise has.
  [[nodiscard]] std::optional<TileLevels> measure(double full);

 private:
  [[nodiscard]] float at(int x, int y) const { return pixels_[static_cast<std::size_t>(y * kTilePx + x)]; }
  [[nodiscard]] double quantile(double share);
  [[nodiscard]] double steepest();
  [[nodiscard]] double period_px(double middle) const;

  std::vector<float> pixels_;
  std::vector<float> room_;
};

}  // namespace slsd
