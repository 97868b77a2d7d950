// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/dense/nodes/surface_grid.hpp"

namespace slsd {

/// Looks for surfaces that growth has not reached because no symbol is decoded there: parts narrower than a codeword.
/// Compares windows without a surface with the pattern at each depth, and adds up the evidence of windows along an
/// upright or a horizontal part. Two letters in a row often match by chance, ten do not:
///
///     place   how much likelier each depth is
///       1      .  .  1  .  .  .  0  .
///       2      .  0  .  2  .  .  .  1
///       3      1  .  .  2  .  0  .  .      a path: 1 2 2, by neighbouring depths
///
/// The evidence of a correlation is learnt in each frame from windows of known depth: their correlations there, and at
/// all wrong depths.
/// @thread thread-bound: keeps its buffers
class SurfaceSearch {
 public:
  /// @param letters  of the pattern: a window covers at most one symbol
  SurfaceSearch(int letters, int window_px);

  /// Searches at nodes of the grid that are neither good nor closed.
  /// @return seeds to grow from; valid until the next call
  [[nodiscard]] std::span<const SurfaceSeed> find(const DenseFrame& frame, const PatternField& field,
                                                  const SurfaceGrid& grid, Executor& executor);
  [[nodiscard]] std::size_t bytes() const;  ///< memory in use

 private:
  /// The depths to try: their inverses are in equal steps of one projector px at the centre of the frame.
  struct Levels {
    double first = 0, step = 0;
    int count = 0;
    [[nodiscard]] double at(int level) const { return first + step * level; }
  };
  /// Places on lines across a thin part: close together on a line, and a window from line to line.
  struct Lines {
    bool upright;  ///< followed from line to line downwards; otherwise from left to right
    int beside_px, next_px, per_line, lines;
    [[nodiscard]] Eigen::Vector2i place(int line, int index) const {
      const int along = next_px / 2 + line * next_px, across = beside_px / 2 + index * beside_px;
      return upright ? Eigen::Vector2i(across, along) : Eigen::Vector2i(along, across);
    }
  };
  struct Scratch {
    std::vector<float> levels, alike;
    float pixels = 0, squares = 0;  // number of the window's pixels, and sum of the squared levels
  };
  static constexpr int kBins = 16;
  /// Numbers of windows by their correlation: at their depth, and at all others.
  struct Correlations {
    std::array<std::uint32_t, kBins> there{}, elsewhere{};
  };

  [[nodiscard]] bool choose_levels(const SurfaceGrid& grid);
  [[nodiscard]] bool read_window(const DenseFrame& frame, const SurfaceGrid& grid, const Eigen::Vector2i& place,
                                 Scratch& scratch) const;
  void compare(const PatternField& field, const SurfaceGrid& grid, const Eigen::Vector2i& place, int first_level,
               int count, Scratch& scratch) const;
  [[nodiscard]] bool learn(const DenseFrame& frame, const PatternField& field, const SurfaceGrid& grid,
                           Executor& executor);
  void compare_known(const DenseFrame& frame, const PatternField& field, const SurfaceGrid& grid,
                     const Eigen::Vector2i& known, std::size_t nth, Scratch& scratch, Correlations& seen) const;
  void find_open(const SurfaceGrid& grid, const Lines& lines);
  template <class Take>
  void follow(const Lines& lines, bool forwards, const Take& take) const;
  void drop_short_paths(const DenseFrame& frame, const SurfaceGrid& grid, const Lines& lines, Executor& executor);
  void weigh(const DenseFrame& frame, const PatternField& field, const SurfaceGrid& grid, Executor& executor);
  void add_up(const Lines& lines, bool forwards, std::vector<float>& best);
  void take_seeds();

  int window_px_;
  float most_;                            // largest evidence of a window
  std::vector<float> xs_, ys_, weights_;  // the window's sampled pixels
  Levels levels_;
  std::array<float, kBins> says_{};  // by correlation: logarithm of how much likelier the depth becomes
  std::vector<std::int32_t> open_;   // for each place: its scores, or -1
  std::vector<Eigen::Vector2i> places_;
  std::vector<float> scores_, before_, after_;  // for the open places, by level
  std::vector<Eigen::Vector2i> known_;          // places in the grid of good nodes, evenly spread
  std::vector<float> ways_, depths_;
  std::vector<int> own_, longest_, all_;  // for the open places: windows with contrast, at the place and on its paths
  std::vector<Scratch> scratch_;
  std::vector<SurfaceSeed> seeds_;
};

}  // namespace slsd
