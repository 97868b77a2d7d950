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
  double clipped_of_lit = 0;  ///< share of the pixels brighter than the middle between lit and dark that are saturated

  [[nodiscard]] double room_light() const { return dark / (lit - dark); }
};

/// A tile in which the pattern is visible.
struct PatternedTile {
  int left = 0, top = 0;  ///< its first pixel
  TileLevels levels;
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
  [[nodiscard]] double clipped_of_lit(double middle, double full) const;

  std::vector<float> pixels_;
  std::vector<float> room_;
};

/// Measures the tiles of a frame, row by row.
/// @param tiles  set to the number of all tiles
/// @return the tiles in which the pattern is visible
/// @thread reentrant
[[nodiscard]] std::vector<PatternedTile> measure_tiles(const GreyView& frame, double full, int& tiles);

}  // namespace slsd
