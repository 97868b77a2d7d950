// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/appearance/patch_map.hpp"
#include "core/appearance/patch_task.hpp"
#include "core/appearance/pattern_field.hpp"
#include "core/geometry/lens.hpp"
#include "core/image.hpp"

namespace slsd {

/// Sizes of blocks and windows. A window around a block's node consists of pieces of blocks:
///
///     +-------+-------+-------+
///     |   .   |   .   |   .   |    blocks of two by two pieces
///     |...+---|---+---|---+...|
///     |   | . |   o   | . |   |    o the node; its window of four by four pieces
///     +---|---+---+---+---|---+
struct BlockSizes {
  int block_px = 1;       ///< side of a block
  int pieces = 1;         ///< pieces along a block's side
  int window_pieces = 1;  ///< pieces along a window's side: odd if `pieces` is

  [[nodiscard]] int window_px() const { return window_pieces * block_px / pieces; }
  /// Number of blocks that a window reaches beyond its own, to each side.
  [[nodiscard]] int reach() const { return (window_pieces - pieces + 2 * pieces - 1) / (2 * pieces); }
};

/// Finds sizes whose window has almost this side; a window of 0 pieces if there are none.
[[nodiscard]] BlockSizes block_sizes(int block_px, int window_px);

/// A row of blocks, each with a plane through its node as the start, and the sums of its pixels.
struct BlockRow {
  /// Numbers of a block. Those of planes and light are as in PatchState, but planes are 1/mm, at the node and for one
  /// camera px.
  enum Number {
    kKnown,  ///< 1 if there is a start
    kInverseDepth,
    kPlaneX,
    kPlaneY,
    kAcross,
    kGain,
    kGainX,
    kGainY,
    kOffset,
    kNoise,
    kPxPer,  ///< found by sum_blocks(): projector px for 1/mm
    kNumbers
  };
  int columns = 0, reach = 0, pieces = 0;
  std::vector<float> numbers, sums;

  void resize(int to_columns, const BlockSizes& sizes);
  /// Distance of two numbers of one block: there is a border of unknown blocks.
  [[nodiscard]] std::size_t pitch() const;
  [[nodiscard]] float* of(Number number) { return numbers.data() + number * pitch() + reach; }
  [[nodiscard]] const float* of(Number number) const { return numbers.data() + number * pitch() + reach; }
};

/// Places of the nodes of a row, and their geometry.
struct BlockPlaces {
  int x_px = 0, y_px = 0;         ///< the first node
  const float* turned = nullptr;  ///< turned_by() of each node, column by column
  std::array<double, 3> translation{};
  Lens projector{};
  EpipolarOffset offset{};
};

/// Groups of eight blocks in a row; the last one overlaps the one before.
[[nodiscard]] inline int block_groups(int columns) {
  return (columns + kEight - 1) / kEight;
}
[[nodiscard]] inline int first_of_group(int group, int columns) {
  return std::min(group * kEight, columns - kEight);
}

/// Sums the equations of each block about its own start. Blocks without a start in a wanted group need numbers that can
/// be computed with. A row has at least eight blocks.
/// @param wanted  for each group of eight, whether to sum it up
/// @thread reentrant
void sum_blocks(const GreyView& frame, double full, const PatternField& field, const AlignOptions& options,
                const BlockSizes& sizes, const BlockPlaces& places, std::span<const char> wanted, BlockRow& row);

/// Fits a plane to the window around each node of a row, by one step from its start. The sums of the window are those
/// of its blocks, referred to this start. So overlapping windows share the work on their pixels.
class BlockFitter {
 public:
  explicit BlockFitter(const BlockSizes& sizes) : sizes_(sizes) {}
  /// Adds up the blocks of each column.
  /// @param rows    2 reach() + 1 rows, around the row to fit; they stay until the last fit_group()
  /// @param wanted  for each group of eight; needed around each group to fit, as far as windows reach
  void add_columns(std::span<const BlockRow* const> rows, std::span<const char> wanted);
  /// Fits a group.
  /// @param tasks  out: failed if a block of the window has no start. Of the maps, only the reference and the scale of
  ///               the disparity are set
  void fit_group(const AlignOptions& options, int group, std::array<PatchTask, kEight>& tasks);

 private:
  BlockSizes sizes_;
  std::vector<const BlockRow*> rows_;
  std::vector<float> columns_;
};

}  // namespace slsd
