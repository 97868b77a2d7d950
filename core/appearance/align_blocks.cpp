// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/appearance/align_blocks.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>

#include "core/appearance/eight_maps.hpp"
#include "core/appearance/patch_equations.hpp"
#include "core/appearance/patch_sums.hpp"
#include "core/clones.hpp"
#include "core/lanes.hpp"

namespace slsd {
namespace {

using enum PatchSum;

inline __attribute__((always_inline)) void store(const Lanes& from, float* to) {
  std::memcpy(to, &from, sizeof from);
}

/// Inputs of sum_row().
template <class T>
struct Summing {
  const T* pixels;  // the frame's first
  FrameAndField of;
  AlignOptions options;
  MapGeometry geometry;
  BlockSizes sizes;
  const float* turned;
  int x_px, y_px, columns;
  const char* wanted;
  std::size_t pitch;
  float *numbers, *sums;  // of the first block
};

/// Fetches the samples that the next group needs: it lies as far from this one as the last block from the first.
inline __attribute__((always_inline)) void fetch_ahead(const FrameAndField& of, const Eight& e) {
  constexpr int kRows = 4, kBlocks = 2;  // samples above and below; blocks that share a cache line
  const int step_u = e.origin_u[kLanes - 1] - e.origin_u[0], step_v = e.origin_v[kLanes - 1] - e.origin_v[0];
  for (int lane = 0; lane < kLanes; lane += kBlocks) {
    const int u = std::clamp(e.origin_u[lane] + step_u + step_u / (kLanes - 1), 0, of.field_width - 1);
    const int v = e.origin_v[lane] + step_v + step_v / (kLanes - 1);
    for (int row = -kRows; row <= kRows; ++row)
      __builtin_prefetch(of.samples +
                         static_cast<std::ptrdiff_t>(std::clamp(v + row, 0, of.field_height - 1)) * of.field_width + u);
  }
}

/// Sums up the pixels of a row of blocks, a group at a time.
template <class T>
inline __attribute__((always_inline)) void sum_row(const Summing<T>& in) {
  const int side = in.sizes.block_px, piece = side / in.sizes.pieces;
  for (int group = 0; group < block_groups(in.columns); ++group) {
    if (!in.wanted[group]) continue;
    const int column = first_of_group(group, in.columns);
    Lanes numbers[BlockRow::kNumbers];
    for (int k = 0; k < BlockRow::kNumbers; ++k) load(in.numbers + k * in.pitch + column, numbers[k]);
    const Lanes x = (kLane + static_cast<float>(column)) * static_cast<float>(side) + static_cast<float>(in.x_px);
    const EightPlanes planes{x,
                             Lanes{} + static_cast<float>(in.y_px),
                             in.turned + static_cast<std::ptrdiff_t>(9) * column,
                             numbers[BlockRow::kInverseDepth],
                             numbers[BlockRow::kPlaneX],
                             numbers[BlockRow::kPlaneY],
                             numbers[BlockRow::kAcross]};
    Eight e;
    Lanes px_per;
    put_maps(in.geometry, planes, e, px_per);
    store(px_per, in.numbers + BlockRow::kPxPer * in.pitch + column);
    e.gain = numbers[BlockRow::kGain], e.gain_x = numbers[BlockRow::kGainX], e.gain_y = numbers[BlockRow::kGainY];
    e.offset = numbers[BlockRow::kOffset], e.noise = numbers[BlockRow::kNoise];
    find_scales(in.options, e);
    fetch_ahead(in.of, e);
    const T* centres[kLanes];
    for (int lane = 0; lane < kLanes; ++lane)
      centres[lane] = in.pixels + in.y_px * in.of.stride + in.x_px + (column + lane) * side;
    float* to = in.sums + column;
    for (int row = 0; row < in.sizes.pieces; ++row) {
      for (int part = 0; part < in.sizes.pieces; ++part) {
        Lanes sums[kPatchSums], counted;
        for (Lanes& sum : sums) sum = Lanes{};
        const int left = part * piece - side / 2, top = row * piece - side / 2;
        add_pixels<PatchShape::kBlock>(centres, in.of, e, {left, left + piece}, {top, top + piece}, sums, nullptr,
                                       counted);
        for (int k = 0; k < kPatchSums; ++k, to += in.pitch) store(sums[k], to);
      }
    }
  }
}

/// The planes and the light of a group.
struct GroupStarts {
  Lanes known, inverse_depth, slope_x, slope_y, across, gain, gain_x, gain_y, offset, px_per;
};
inline __attribute__((always_inline)) void load_starts(const float* numbers, std::size_t pitch, GroupStarts& to) {
  const auto number = [&](BlockRow::Number which, Lanes & lanes) __attribute__((always_inline)) {
    load(numbers + which * pitch, lanes);
  };
  number(BlockRow::kKnown, to.known), number(BlockRow::kInverseDepth, to.inverse_depth);
  number(BlockRow::kPlaneX, to.slope_x), number(BlockRow::kPlaneY, to.slope_y), number(BlockRow::kAcross, to.across);
  number(BlockRow::kGain, to.gain), number(BlockRow::kGainX, to.gain_x), number(BlockRow::kGainY, to.gain_y);
  number(BlockRow::kOffset, to.offset), number(BlockRow::kPxPer, to.px_per);
}

/// The parameters of a start less those of another, about the other's node.
struct Apart {
  Lanes disparity, slope_x, slope_y, gain, gain_x, gain_y, offset, across;
};
/// @param x, y  place of the other's node relative to the start's, px
inline __attribute__((always_inline)) void find_apart(const GroupStarts& start, const GroupStarts& other, float x,
                                                      float y, Apart& to) {
  const Lanes levels = other.gain * other.px_per;
  to.disparity = levels * (start.inverse_depth + x * start.slope_x + y * start.slope_y - other.inverse_depth);
  to.slope_x = levels * (start.slope_x - other.slope_x), to.slope_y = levels * (start.slope_y - other.slope_y);
  to.gain = start.gain + x * start.gain_x + y * start.gain_y - other.gain;
  to.gain_x = start.gain_x - other.gain_x, to.gain_y = start.gain_y - other.gain_y;
  to.offset = start.offset - other.offset, to.across = other.gain * (start.across - other.across);
}

/// Refers sums to another start: takes from the residuals what its parameters explain.
inline __attribute__((always_inline)) void refer(const Apart& by, Lanes* sums) {
  const auto sum = [&](PatchSum which) __attribute__((always_inline))->Lanes& {
    return sums[static_cast<int>(which)];
  };
  const auto explain = [&](PatchSum right, const Lanes& step, PatchSum of_d, PatchSum of_x, PatchSum of_y,
                           PatchSum of_a, PatchSum of_ax, PatchSum of_ay, PatchSum of_o, PatchSum of_c)
      __attribute__((always_inline)) {
    const Lanes taken = sum(of_d) * by.disparity + sum(of_x) * by.slope_x + sum(of_y) * by.slope_y +
                        sum(of_a) * by.gain + sum(of_ax) * by.gain_x + sum(of_ay) * by.gain_y + sum(of_o) * by.offset +
                        sum(of_c) * by.across;
    sum(kRR) += step * (taken - 2 * sum(right));
    sum(right) -= taken;
  };
  explain(kGR, by.disparity, kGG, kGGx, kGGy, kGP, kGPx, kGPy, kG, kGC);
  explain(kGRx, by.slope_x, kGGx, kGGxx, kGGxy, kGPx, kGPxx, kGPxy, kGx, kGCx);
  explain(kGRy, by.slope_y, kGGy, kGGxy, kGGyy, kGPy, kGPxy, kGPyy, kGy, kGCy);
  explain(kPR, by.gain, kGP, kGPx, kGPy, kPP, kPPx, kPPy, kP, kPC);
  explain(kPRx, by.gain_x, kGPx, kGPxx, kGPxy, kPPx, kPPxx, kPPxy, kPx, kPCx);
  explain(kPRy, by.gain_y, kGPy, kGPxy, kGPyy, kPPy, kPPxy, kPPyy, kPy, kPCy);
  explain(kR, by.offset, kG, kGx, kGy, kP, kPx, kPy, kOne, kC);
  explain(kCR, by.across, kGC, kGCx, kGCy, kPC, kPCx, kPCy, kC, kCC);
}

/// Moves the origin of places along an axis: places grow by `by`.
template <bool kAlongX>
inline __attribute__((always_inline)) void move_places(float by, Lanes* sums) {
  constexpr int kFirst = kAlongX ? 1 : 2, kOther = kAlongX ? 2 : 1, kSecond = kAlongX ? 3 : 5, kMixed = 4;
  for (const PatchSum which : {kGG, kGP, kPP}) {
    Lanes* const of = sums + static_cast<int>(which);
    of[kSecond] += by * (2 * of[kFirst] + by * of[0]);
    of[kMixed] += by * of[kOther];
    of[kFirst] += by * of[0];
  }
  for (const PatchSum which : {kG, kP, kGC, kPC, kGR, kPR}) {
    Lanes* const of = sums + static_cast<int>(which);
    of[kFirst] += by * of[0];
  }
}

/// Numbers for each piece of a column: the sums, those of its three parts, and whether all blocks are known.
constexpr int kOfThirds = 4, kColumnNumbers = kPatchSums + 3 * kOfThirds + 1;

/// The pieces of the other block that lie within the window, `away` blocks from the middle.
struct PieceRange {
  int first, end;
};
PieceRange pieces_within(const BlockSizes& sizes, int away) {
  const int first = (sizes.pieces - sizes.window_pieces) / 2 - away * sizes.pieces;
  return {std::max(0, first), std::min(sizes.pieces, first + sizes.window_pieces)};
}
constexpr int kReachMost = 16;

struct Adding {
  const float* numbers[2 * kReachMost + 1];  // of the group's first block, row by row
  const float* sums[2 * kReachMost + 1];
  PieceRange within[2 * kReachMost + 1];
  BlockSizes sizes;
  int reach;
  std::size_t pitch;
  float* to;
};

inline __attribute__((always_inline)) void add_column(const Adding& in) {
  GroupStarts start;
  load_starts(in.numbers[in.reach], in.pitch, start);
  for (int piece = 0; piece < in.sizes.pieces; ++piece) {
    Lanes total[kPatchSums], thirds[3][kOfThirds], known = Lanes{} + 1;
    for (Lanes& sum : total) sum = Lanes{};
    for (auto& third : thirds)
      for (Lanes& sum : third) sum = Lanes{};
    for (int row = 0; row <= 2 * in.reach; ++row) {
      const auto off = static_cast<float>((row - in.reach) * in.sizes.block_px);
      Lanes sums[kPatchSums];
      for (Lanes& sum : sums) sum = Lanes{};
      for (int down = in.within[row].first; down < in.within[row].end; ++down) {
        const float* from = in.sums[row] + (down * in.sizes.pieces + piece) * kPatchSums * in.pitch;
        for (int k = 0; k < kPatchSums; ++k) {
          Lanes more;
          load(from + k * in.pitch, more);
          sums[k] += more;
        }
      }
      if (row != in.reach) {
        GroupStarts other;
        load_starts(in.numbers[row], in.pitch, other);
        Apart apart;
        find_apart(start, other, 0, off, apart);
        refer(apart, sums);
        known *= other.known;
      }
      Lanes* const third = thirds[row < in.reach ? 0 : row > in.reach ? 2 : 1];
      third[0] += sums[static_cast<int>(kGG)], third[1] += sums[static_cast<int>(kGP)];
      third[2] += sums[static_cast<int>(kG)], third[3] += sums[static_cast<int>(kGR)];
      if (row != in.reach) move_places<false>(off, sums);
      for (int k = 0; k < kPatchSums; ++k) total[k] += sums[k];
    }
    float* to = in.to + static_cast<std::ptrdiff_t>(piece) * kColumnNumbers * in.pitch;
    for (int k = 0; k < kPatchSums; ++k, to += in.pitch) store(total[k], to);
    for (const auto& third : thirds)
      for (int k = 0; k < kOfThirds; ++k, to += in.pitch) store(third[k], to);
    store(known * start.known, to);
  }
}

struct Fitting {
  const float* numbers;  // of the group's first block
  const float* columns;
  PieceRange within[2 * kReachMost + 1];
  BlockSizes sizes;
  AlignOptions options;
  int reach;
  std::size_t pitch;
};

inline __attribute__((always_inline)) void fit_eight(const Fitting& in, Lanes& all_known, GroupStarts& start,
                                                     EightSteps& steps) {
  load_starts(in.numbers, in.pitch, start);
  Lanes total[kPatchSums];
  NinthSums ninths[3][3]{};
  for (Lanes& sum : total) sum = Lanes{};
  all_known = Lanes{} + 1;
  const float away = 0.25F * static_cast<float>(in.sizes.window_px() + in.sizes.block_px);
  for (int beside = -in.reach; beside <= in.reach; ++beside) {
    const auto off = static_cast<float>(beside * in.sizes.block_px);
    const PieceRange& within = in.within[beside + in.reach];
    Lanes sums[kColumnNumbers];
    for (Lanes& sum : sums) sum = Lanes{};
    for (int piece = within.first; piece < within.end; ++piece) {
      const float* from = in.columns + static_cast<std::ptrdiff_t>(piece) * kColumnNumbers * in.pitch + beside;
      for (int k = 0; k < kColumnNumbers; ++k) {
        Lanes more;
        load(from + k * in.pitch, more);
        sums[k] += more;
      }
    }
    all_known = sums[kColumnNumbers - 1] > Lanes{} ? all_known : Lanes{};
    Apart apart{};
    if (beside != 0) {
      GroupStarts other;
      load_starts(in.numbers + beside, in.pitch, other);
      find_apart(start, other, off, 0, apart);
      refer(apart, sums);
    }
    for (int third = 0; third < 3; ++third) {
      const Lanes* const part = sums + kPatchSums + third * kOfThirds;
      NinthSums& ninth = ninths[third][beside < 0 ? 0 : beside > 0 ? 2 : 1];
      const float y = static_cast<float>(third - 1) * away;
      ninth.gg += part[0], ninth.gp += part[1], ninth.g += part[2];
      ninth.gr += part[3] - part[0] * (apart.disparity + y * apart.slope_y) -
                  part[1] * (apart.gain + y * apart.gain_y) - part[2] * apart.offset;
    }
    if (beside != 0) move_places<true>(off, sums);
    for (int k = 0; k < kPatchSums; ++k) total[k] += sums[k];
  }
  Eight e;
  e.gain = start.gain, e.gain_x = start.gain_x, e.gain_y = start.gain_y, e.across = start.across;
  load(in.numbers + BlockRow::kNoise * in.pitch, e.noise);
  find_scales(in.options, e);
  steps.pixels = Lanes{} + static_cast<float>(in.sizes.window_px() * in.sizes.window_px());
  steps.weights = total[static_cast<int>(kOne)], steps.agreed = total[static_cast<int>(kAgreed)];
  set_up(total, steps.equations);
  add_priors(e, steps.equations);
  solve(steps.equations);
  find_scatter(ninths, away, steps.weights, steps.equations, steps.scatter);
}

}  // namespace

BlockSizes block_sizes(int block_px, int window_px) {
  for (int pieces = 1; pieces <= block_px; ++pieces) {
    if (block_px % pieces != 0) continue;
    for (int count = pieces % 2 == 1 ? 1 : 2; count * block_px <= (window_px + 1) * pieces; count += 2) {
      const BlockSizes sizes{block_px, pieces, count};
      if (std::abs(sizes.window_px() - window_px) <= 1 && sizes.reach() <= kReachMost) return sizes;
    }
  }
  return {block_px, 1, 0};
}

std::size_t BlockRow::pitch() const {
  return static_cast<std::size_t>(columns) + 2 * reach + kLanes;
}

void BlockRow::resize(int to_columns, const BlockSizes& sizes) {
  if (columns == to_columns && reach == sizes.reach() && pieces == sizes.pieces) return;
  columns = to_columns, reach = sizes.reach(), pieces = sizes.pieces;
  numbers.assign(kNumbers * pitch(), 0);
  sums.assign(static_cast<std::size_t>(kPatchSums) * pieces * pieces * pitch(), 0);
}

void sum_blocks(const GreyView& frame, double full, const PatternField& field, const AlignOptions& options,
                const BlockSizes& sizes, const BlockPlaces& places, std::span<const char> wanted, BlockRow& row) {
  std::visit(
      [&](const auto& pixels) {
        using T = std::remove_cvref_t<decltype(*pixels.pixels)>;
        const auto& [x, y, z] = places.translation;
        Cloned<sum_row<T>>::call(Summing<T>{pixels.row(0),
                                            {pixels.stride, static_cast<float>(full), field.samples(), field.width(),
                                             field.height(), field.slope_unit()},
                                            options,
                                            {{x, y, z}, places.projector, places.offset},
                                            sizes,
                                            places.turned,
                                            places.x_px,
                                            places.y_px,
                                            row.columns,
                                            wanted.data(),
                                            row.pitch(),
                                            row.numbers.data() + row.reach,
                                            row.sums.data() + row.reach});
      },
      frame);
}

void BlockFitter::add_columns(std::span<const BlockRow* const> rows, std::span<const char> wanted) {
  rows_.assign(rows.begin(), rows.end());
  const int reach = sizes_.reach(), columns = rows[0]->columns;
  const std::size_t pitch = rows[0]->pitch();
  columns_.resize(static_cast<std::size_t>(kColumnNumbers) * sizes_.pieces * pitch);
  Adding adding{};
  adding.sizes = sizes_, adding.reach = reach, adding.pitch = pitch;
  for (int row = 0; row <= 2 * reach; ++row) adding.within[row] = pieces_within(sizes_, row - reach);
  for (int group = 0; group < block_groups(columns); ++group) {
    if (!wanted[group]) continue;
    const int column = first_of_group(group, columns) + reach;
    for (int row = 0; row <= 2 * reach; ++row)
      adding.numbers[row] = rows[row]->numbers.data() + column, adding.sums[row] = rows[row]->sums.data() + column;
    adding.to = columns_.data() + column;
    Cloned<add_column>::call(adding);
  }
}

void BlockFitter::fit_group(const AlignOptions& options, int group, std::array<PatchTask, kEight>& tasks) {
  const int reach = sizes_.reach();
  const BlockRow& row = *rows_[reach];
  const int column = first_of_group(group, row.columns);
  Fitting fitting{
      row.numbers.data() + reach + column, columns_.data() + reach + column, {}, sizes_, options, reach, row.pitch()};
  for (int beside = 0; beside <= 2 * reach; ++beside) fitting.within[beside] = pieces_within(sizes_, beside - reach);
  Lanes known;
  GroupStarts start;
  EightSteps steps;
  Cloned<fit_eight>::call(fitting, known, start, steps);
  for (int lane = 0; lane < kEight; ++lane) {
    PatchTask& task = tasks[lane];
    task.failed = !(known[lane] > 0);
    if (task.failed) continue;
    const float px_per = start.px_per[lane];
    task.map.reference_inverse_depth = static_cast<double>(start.inverse_depth[lane]);
    task.map.inverse_depth_per_px = 1 / static_cast<double>(px_per);
    task.state = {};
    task.state.slope_x = start.slope_x[lane] * px_per, task.state.slope_y = start.slope_y[lane] * px_per;
    task.state.across = start.across[lane], task.state.gain = start.gain[lane];
    task.state.gain_x = start.gain_x[lane], task.state.gain_y = start.gain_y[lane];
    task.state.offset = start.offset[lane];
    task.noise = row.of(BlockRow::kNoise)[column + lane];
    take(steps, lane, task);
  }
}

}  // namespace slsd
