// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/nodes/refine_grid.hpp"

#include <algorithm>
#include <cmath>

namespace slsd {
namespace {

/// Distance of coarse nodes, px: surfaces that differ from a second order by a tenth of a pixel within it are rare.
constexpr int kCoarsePx = 24;
/// Windows with fewer pixels, for each node of the grid, are as quick to align alone.
constexpr int kSharedMin = 4;
/// Largest difference between the surfaces of a cell's corners at its middle, projector px.
constexpr float kCellAgreePx = 0.3F;
/// A node that moves by more has left the range in which one step is exact.
constexpr float kMovedMax = 0.1F;
/// Number of rows that one worker refines together: its first and last rows are summed twice.
constexpr int kPartRows = 24;

}  // namespace

GridRefiner::GridRefiner(const SurfaceGrid& grid) : sizes_(block_sizes(grid.stride_px(), grid.window_px())) {
  const int stride = grid.stride_px(), window = sizes_.window_px();
  lattice_.step = 1, window_px_ = grid.window_px();
  if (window * window < kSharedMin * stride * stride || grid.columns() < kEight) return;
  lattice_.step = std::max(1, kCoarsePx / stride);
  lattice_.first = (grid.window_px() / 2 - grid.x_of(0) + stride - 1) / stride;
  lattice_.columns = (grid.columns() - lattice_.first + lattice_.step - 1) / lattice_.step;
  lattice_.rows = (grid.rows() - lattice_.first + lattice_.step - 1) / lattice_.step;
  if (lattice_.columns < 2 || lattice_.rows < 2) lattice_.step = 1;
  if (lattice_.step > 1) window_px_ = window | 1;
}

std::size_t GridRefiner::bytes() const {
  std::size_t bytes = cells_.capacity() + good_.capacity();
  for (const Scratch& scratch : scratch_)
    for (const BlockRow& row : scratch.rows) bytes += (row.numbers.capacity() + row.sums.capacity()) * sizeof(float);
  return bytes;
}

/// Finds the cells of the lattice whose corners are one surface.
void GridRefiner::find_cells(const SurfaceGrid& grid) {
  cells_.assign(static_cast<std::size_t>(lattice_.columns) * lattice_.rows, 0);
  const float half = 0.5F * static_cast<float>(lattice_.step * grid.stride_px());
  for (int row = 0; row + 1 < lattice_.rows; ++row) {
    for (int column = 0; column + 1 < lattice_.columns; ++column) {
      std::array<const SurfaceNode*, 4> corners;
      for (int k = 0; k < 4; ++k) corners[k] = grid.good(lattice_.of(column + k % 2), lattice_.of(row + k / 2));
      if (std::ranges::count(corners, nullptr) > 0) continue;
      float slope_x = 0, slope_y = 0;
      for (const SurfaceNode* corner : corners)
        slope_x += 0.25F * corner->plane.slope_x, slope_y += 0.25F * corner->plane.slope_y;
      float least = std::numeric_limits<float>::max(), most = std::numeric_limits<float>::lowest();
      for (int k = 0; k < 4; ++k) {
        const SurfacePlane& plane = corners[k]->plane;
        const float x = k % 2 == 0 ? half : -half, y = k / 2 == 0 ? half : -half;
        const float there =
            plane.inverse_depth + 0.5F * (x * (plane.slope_x + slope_x) + y * (plane.slope_y + slope_y));
        least = std::min(least, there), most = std::max(most, there);
      }
      cells_[static_cast<std::size_t>(row) * lattice_.columns + column] =
          most - least < kCellAgreePx * corners[0]->per_px;
    }
  }
}

namespace {

void numbers_of(const SurfaceNode& node, float* to) {
  to[BlockRow::kKnown] = 1;
  to[BlockRow::kInverseDepth] = node.plane.inverse_depth;
  to[BlockRow::kPlaneX] = node.plane.slope_x, to[BlockRow::kPlaneY] = node.plane.slope_y;
  to[BlockRow::kAcross] = node.across, to[BlockRow::kGain] = node.gain;
  to[BlockRow::kGainX] = node.gain_x, to[BlockRow::kGainY] = node.gain_y, to[BlockRow::kOffset] = node.offset;
}

/// The surface between two places, `along` px from the first: the mean of a plane's slope and the slope here continues
/// it exactly over any surface of the second order.
template <BlockRow::Number kSlope>
void between(const float* first, const float* second, float share, float along, float distance, float* to) {
  for (int k = 0; k < BlockRow::kNoise; ++k) to[k] = first[k] + share * (second[k] - first[k]);
  const float from_first = first[BlockRow::kInverseDepth] + 0.5F * along * (first[kSlope] + to[kSlope]),
              from_second = second[BlockRow::kInverseDepth] + 0.5F * (along - distance) * (second[kSlope] + to[kSlope]);
  to[BlockRow::kInverseDepth] = from_first + share * (from_second - from_first);
}

}  // namespace

/// Sets the numbers of the nodes in one-surface cells.
void GridRefiner::interpolate(const SurfaceGrid& grid, int row, Scratch& scratch, BlockRow& to) const {
  const int down = row - lattice_.first, above = down / lattice_.step, below = down % lattice_.step;
  if (down < 0 || above >= lattice_.rows) return;
  const auto distance = static_cast<float>(lattice_.step * grid.stride_px());
  std::vector<char>& inside = scratch.inside;
  inside.assign(lattice_.columns, 0);
  for (int k = 0; k + 1 < lattice_.columns; ++k) {
    const std::size_t cell = static_cast<std::size_t>(above) * lattice_.columns + k;
    inside[k] = cells_[cell] != 0 || (below == 0 && above > 0 && cells_[cell - lattice_.columns] != 0);
  }
  scratch.edges.resize(lattice_.columns);
  const auto along_y = static_cast<float>(below * grid.stride_px());
  for (int k = 0; k < lattice_.columns; ++k) {
    if (!inside[k] && (k == 0 || !inside[k - 1])) continue;
    Edge top, bottom;
    numbers_of(*grid.good(lattice_.of(k), lattice_.of(above)), top.data());
    if (below == 0) {
      scratch.edges[k] = top;
      continue;
    }
    numbers_of(*grid.good(lattice_.of(k), lattice_.of(above + 1)), bottom.data());
    between<BlockRow::kPlaneY>(top.data(), bottom.data(), along_y / distance, along_y, distance,
                               scratch.edges[k].data());
  }
  const std::size_t pitch = to.pitch();
  float* const numbers = to.of(BlockRow::kKnown);
  for (int k = 0; k + 1 < lattice_.columns; ++k) {
    if (!inside[k]) continue;
    for (int right = 0; right <= lattice_.step; ++right) {
      const auto along_x = static_cast<float>(right * grid.stride_px());
      Edge node;
      between<BlockRow::kPlaneX>(scratch.edges[k].data(), scratch.edges[k + 1].data(), along_x / distance, along_x,
                                 distance, node.data());
      float* const column = numbers + lattice_.of(k) + right;
      for (int i = 0; i < BlockRow::kNoise; ++i) column[i * pitch] = node[i];
    }
  }
}

/// Sets the starts of a row. @return whether it has nodes to fit
bool GridRefiner::start_row(const DenseFrame& frame, const SurfaceGrid& grid, int row, Scratch& scratch, BlockRow& to,
                            std::vector<char>& needed) const {
  to.resize(grid.columns(), sizes_);
  needed.assign(block_groups(grid.columns()), 0);
  float* const known = to.of(BlockRow::kKnown);
  std::fill(known, known + grid.columns(), 0.F);
  const auto [width, height] = grid.frame_px();
  const int before = grid.x_of(0);
  if (row < 0 || row >= grid.rows() || grid.y_of(row) - before + grid.stride_px() > height) return false;
  interpolate(grid, row, scratch, to);
  bool any = false;
  const std::size_t pitch = to.pitch();
  for (int column = 0; column < grid.columns(); ++column) {
    const std::size_t index = static_cast<std::size_t>(row) * grid.columns() + column;
    if (good_[index]) {
      Edge own;
      numbers_of(grid.nodes()[index], own.data());
      for (int i = 0; i < BlockRow::kNoise; ++i) known[i * pitch + column] = own[i];
    }
    if (grid.x_of(column) - before + grid.stride_px() > width) known[column] = 0;
  }
  for (std::size_t group = 0; group < needed.size(); ++group) {
    const int first = first_of_group(static_cast<int>(group), grid.columns());
    const float* const with = std::find(known + first, known + first + kEight, 1.F);
    if (with == known + first + kEight) continue;
    for (int column = first; column < first + kEight; ++column) {
      if (known[column] > 0) {
        const std::size_t index = static_cast<std::size_t>(row) * grid.columns() + column;
        needed[group] = needed[group] || !(good_[index] || grid.is_closed(index));
        continue;
      }
      // Numbers to compute with.
      for (int i = 1; i < BlockRow::kNoise; ++i) known[i * pitch + column] = with[i * pitch];
    }
    any = any || needed[group] != 0;
  }
  const float *const gain = to.of(BlockRow::kGain), *const offset = to.of(BlockRow::kOffset);
  float* const noise = to.of(BlockRow::kNoise);
  for (int column = 0; column < grid.columns(); ++column)
    noise[column] = frame.noise.at(offset[column] + 0.5F * gain[column]);
  return any;
}

namespace {

/// A group without a node to sum up.
constexpr std::uint8_t kNoBlur = 255;

/// Finds the level of each group's blur, which is that of its first node with a start.
void find_blurs(const BlurredPattern& pattern, const SurfaceGrid& grid, int row, const BlockRow& blocks,
                std::vector<std::uint8_t>& blurs) {
  blurs.assign(block_groups(grid.columns()), kNoBlur);
  const float *const known = blocks.of(BlockRow::kKnown), *const inverse_depth = blocks.of(BlockRow::kInverseDepth);
  for (std::size_t group = 0; group < blurs.size(); ++group) {
    const int first = first_of_group(static_cast<int>(group), grid.columns());
    for (int column = first; column < first + kEight; ++column) {
      if (!(known[column] > 0)) continue;
      const Eigen::Vector2f at(static_cast<float>(grid.x_of(column)), static_cast<float>(grid.y_of(row)));
      blurs[group] = static_cast<std::uint8_t>(pattern.level_at(at, inverse_depth[column]));
      break;
    }
  }
}

}  // namespace

/// Takes the nodes of a group that its blur suits; others are left to SurfaceGrid::grow().
void GridRefiner::take_group(const BlurredPattern& pattern, SurfaceGrid& grid, int row, int group, int blur,
                             const Scratch& scratch) const {
  const int first = first_of_group(group, grid.columns());
  for (int lane = 0; lane < kEight; ++lane) {
    const PatchTask& task = scratch.tasks[lane];
    const std::size_t index = static_cast<std::size_t>(row) * grid.columns() + first + lane;
    if (task.failed || !(std::abs(task.moved) < kMovedMax) || good_[index] || grid.is_closed(index)) continue;
    const Eigen::Vector2f at(static_cast<float>(grid.x_of(first + lane)), static_cast<float>(grid.y_of(row)));
    if (!pattern.suits(blur, at, static_cast<float>(task.map.reference_inverse_depth))) continue;
    SurfaceNode& node = grid.nodes()[index];
    if (grid.accept(task, node)) node.blur = static_cast<std::uint8_t>(blur);
  }
}

void GridRefiner::refine_rows(const DenseFrame& frame, const BlurredPattern& pattern, SurfaceGrid& grid, int first,
                              int end, Scratch& scratch) {
  const int reach = sizes_.reach(), around = 2 * reach + 1, groups = block_groups(grid.columns());
  scratch.rows.resize(around), scratch.needed.resize(around), scratch.around.resize(around);
  scratch.blurs.resize(around);
  const auto place = [&](int row) { return static_cast<std::size_t>((row - first + reach) % around); };
  for (int row = first - reach; row < end + reach; ++row) {
    BlockRow& blocks = scratch.rows[place(row)];
    std::vector<char>& needed = scratch.needed[place(row)];
    start_row(frame, grid, row, scratch, blocks, needed);
    std::vector<std::uint8_t>& blurs = scratch.blurs[place(row)];
    find_blurs(pattern, grid, row, blocks, blurs);
    for (int blur = 0; blur < pattern.levels(); ++blur) {
      scratch.wanted.resize(groups);
      std::ranges::transform(blurs, scratch.wanted.begin(), [&](std::uint8_t of) { return of == blur ? 1 : 0; });
      if (std::ranges::count(scratch.wanted, 1) > 0)
        sum_blocks(frame.pixels, frame.full, pattern.field(blur), SurfaceGrid::kAlign, sizes_, grid.places_of(row),
                   scratch.wanted, blocks);
    }
    const int middle = row - reach;
    if (middle < first) continue;
    const std::vector<char>& to_fit = scratch.needed[place(middle)];
    scratch.wanted.assign(groups, 0);
    const int beside = (reach + kEight - 1) / kEight + 1;
    for (int group = 0; group < groups; ++group)
      for (int other = std::max(0, group - beside); to_fit[group] && other <= std::min(groups - 1, group + beside);
           ++other)
        scratch.wanted[other] = 1;
    for (int k = 0; k < around; ++k) scratch.around[k] = &scratch.rows[place(middle - reach + k)];
    scratch.fitter.add_columns(scratch.around, scratch.wanted);
    for (int group = 0; group < groups; ++group) {
      if (!to_fit[group]) continue;
      scratch.fitter.fit_group(SurfaceGrid::kAlign, group, scratch.tasks);
      take_group(pattern, grid, middle, group, scratch.blurs[place(middle)][group], scratch);
    }
  }
}

void GridRefiner::refine(const DenseFrame& frame, const BlurredPattern& pattern, SurfaceGrid& grid,
                         Executor& executor) {
  if (lattice_.step == 1) return;
  while (scratch_.size() < static_cast<std::size_t>(executor.workers())) scratch_.emplace_back(sizes_);
  find_cells(grid);
  // Workers read nodes that were good before, and write only others.
  good_.resize(grid.nodes().size());
  std::ranges::transform(grid.nodes(), good_.begin(), [](const SurfaceNode& node) { return node.good; });
  executor.run((grid.rows() + kPartRows - 1) / kPartRows, [&](int part, int worker) {
    const int first = part * kPartRows;
    refine_rows(frame, pattern, grid, first, std::min(grid.rows(), first + kPartRows), scratch_[worker]);
  });
}

}  // namespace slsd
