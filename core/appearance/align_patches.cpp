// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/appearance/align_patches.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/appearance/patch_equations.hpp"
#include "core/appearance/patch_sums.hpp"
#include "core/clones.hpp"
#include "core/lanes.hpp"

namespace slsd {
namespace {

static_assert(kEight == kLanes);
using enum Fitted::Unknown;

/// One step of Gauss and Newton. The right-hand side is the residual, so that no large numbers cancel.
template <PatchShape kShape, class T>
inline __attribute__((always_inline)) void step_eight(const T* const* centres, const FrameAndField& of,
                                                      const AlignOptions& options, int side, Eight& e, EightSteps& to) {
  const Lanes zero{};
  find_scales(options, e);
  NinthSums ninths[3][3]{};
  Lanes sums[kPatchSums], counted = zero + static_cast<float>(kShape == PatchShape::kCell ? 0 : side * side);
  for (Lanes& sum : sums) sum = zero;
  const int half = side / 2;
  const PixelRange range{-half, half + 1};
  add_pixels<kShape>(centres, of, e, range, range, sums, ninths, counted);
  to.pixels = counted;
  to.weights = sums[static_cast<int>(PatchSum::kOne)], to.agreed = sums[static_cast<int>(PatchSum::kAgreed)];
  set_up(sums, to.equations);
  add_priors(e, to.equations);
  solve(to.equations);
  find_scatter(ninths, static_cast<float>((half + (side - 1) / 6 + 1) / 2), to.weights, to.equations, to.scatter);
}

/// Estimates the mean of a window from its diagonals.
template <class T>
float level_of(const ImageView<T>& frame, const PatchTask& task, int half) {
  float sum = 0;
  for (int i = -half; i <= half; ++i)
    sum += static_cast<float>(frame.at(task.x + i, task.y + i)) + static_cast<float>(frame.at(task.x - i, task.y + i));
  return sum / static_cast<float>(4 * half + 2);
}

void put(Eight& e, int lane, const PatchTask& task) {
  const PatchMap& map = task.map;
  const PatchState& state = task.state;
  for (int k = 0; k < 3; ++k) {
    e.constant[k][lane] = map.base(k, 2) + map.shift[k] * state.disparity;
    e.x[k][lane] = map.base(k, 0) + map.shift[k] * state.slope_x;
    e.y[k][lane] = map.base(k, 1) + map.shift[k] * state.slope_y;
  }
  e.across_u[lane] = -state.across * map.along.y(), e.across_v[lane] = state.across * map.along.x();
  e.along_u[lane] = map.along.x(), e.along_v[lane] = map.along.y();
  e.origin_u[lane] = (map.origin_px.x() + PatternField::kBorderPx) * PatternField::kSamplesPerPx;
  e.origin_v[lane] = (map.origin_px.y() + PatternField::kBorderPx) * PatternField::kSamplesPerPx;
  e.gain[lane] = state.gain, e.gain_x[lane] = state.gain_x, e.gain_y[lane] = state.gain_y;
  e.offset[lane] = state.offset, e.noise[lane] = task.noise, e.across[lane] = state.across;
}

void take_covariance(const EightEquations& e, int lane, CellTask& task) {
  const float per_gain = 1 / task.patch.state.gain;
  for (int row = 0; row < 3; ++row)
    for (int column = row; column < 3; ++column)
      task.covariance(row, column) = task.covariance(column, row) =
          e.covariance[row][column][lane] * per_gain * per_gain;
}

FrameAndField frame_and_field(std::ptrdiff_t stride, double full, const PatternField& field) {
  return {stride, static_cast<float>(full), field.samples(), field.width(), field.height(), field.slope_unit()};
}

template <class T>
void align(const ImageView<T>& frame, double full, const PatternField& field, const AlignOptions& options,
           int window_px, std::span<PatchTask* const> tasks) {
  Eight eight;
  const T* centres[kEight];
  for (int lane = 0; lane < kEight; ++lane) {
    // Unused lanes repeat the first one.
    PatchTask& task = *tasks[static_cast<std::size_t>(lane) < tasks.size() ? lane : 0];
    if (!(task.state.gain > 0)) task.state.offset = level_of(frame, task, window_px / 2);
    centres[lane] = frame.row(task.y) + task.x;
    put(eight, lane, task);
  }
  EightSteps steps;
  Cloned<step_eight<PatchShape::kWindow, T>>::call(centres, frame_and_field(frame.stride, full, field), options,
                                                   window_px, eight, steps);
  for (std::size_t lane = 0; lane < tasks.size(); ++lane) take(steps, static_cast<int>(lane), *tasks[lane]);
}

/// Adds the properties that only cells have.
template <class T>
void put_cell(Eight& e, int lane, const ImageView<T>& frame, const CellTask& task) {
  const PatchMap& map = task.patch.map;
  const PatchState& state = task.patch.state;
  for (int k = 0; k < 3; ++k) {
    e.xx[k][lane] = map.shift[k] * state.bend_xx;
    e.xy[k][lane] = map.shift[k] * state.bend_xy;
    e.yy[k][lane] = map.shift[k] * state.bend_yy;
  }
  const Eigen::Vector2f square = task.square_middle_px - map.origin_px.cast<float>();
  e.square_u[lane] = square.x(), e.square_v[lane] = square.y(), e.square_half[lane] = task.square_half_px;
  e.left_px[lane] = -task.patch.x, e.right_px[lane] = frame.width - 1 - task.patch.x;
  e.top_px[lane] = -task.patch.y, e.bottom_px[lane] = frame.height - 1 - task.patch.y;
}

/// Aligns up to eight cells in all steps. The largest window serves all.
template <class T>
void align_some(const ImageView<T>& frame, double full, const PatternField& field, const AlignOptions& options,
                std::span<CellTask> tasks) {
  Eight eight;
  const T* centres[kEight];
  const int window_px = std::ranges::max(tasks, {}, &CellTask::window_px).window_px;
  const FrameAndField of = frame_and_field(frame.stride, full, field);
  EightSteps steps;
  for (int step = 0; step < options.steps; ++step) {
    for (int lane = 0; lane < kEight; ++lane) {
      CellTask& task = tasks[static_cast<std::size_t>(lane) < tasks.size() ? lane : 0];
      centres[lane] = frame.row(task.patch.y) + task.patch.x;
      if (!(task.patch.state.gain > 0)) task.patch.state.offset = static_cast<float>(*centres[lane]);
      put(eight, lane, task.patch);
      put_cell(eight, lane, frame, task);
    }
    Cloned<step_eight<PatchShape::kCell, T>>::call(centres, of, options, window_px, eight, steps);
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      if (tasks[i].patch.failed) continue;
      const auto lane = static_cast<int>(i);
      take(steps, lane, tasks[i].patch);
      if (!tasks[i].patch.failed) take_covariance(steps.equations, lane, tasks[i]);
    }
  }
}

}  // namespace

void align_eight(const GreyView& frame, double full, const PatternField& field, const AlignOptions& options,
                 int window_px, std::span<PatchTask* const> tasks) {
  std::visit([&](const auto& pixels) { align(pixels, full, field, options, window_px, tasks); }, frame);
}

void fetch_windows(const PatternField& field, int window_px, std::span<const PatchTask* const> tasks) {
  constexpr int kPerLine = 64 / sizeof(std::uint32_t);  // samples in a cache line
  const float reach = 0.5F * static_cast<float>(window_px * PatternField::kSamplesPerPx);
  for (const PatchTask* task : tasks) {
    const Eigen::Matrix3f& base = task->map.base;
    const auto samples = [&](int row) {
      return static_cast<int>(reach * (std::abs(base(row, 0)) + std::abs(base(row, 1)))) + 1;
    };
    const int reach_u = samples(0), reach_v = samples(1);
    const Eigen::Vector2i middle =
        (task->map.origin_px + Eigen::Vector2i::Constant(PatternField::kBorderPx)) * PatternField::kSamplesPerPx;
    const int first_u = std::max(0, middle.x() - reach_u), last_u = std::min(field.width() - 1, middle.x() + reach_u);
    const int first_v = std::max(0, middle.y() - reach_v), last_v = std::min(field.height() - 1, middle.y() + reach_v);
    for (int v = first_v; v <= last_v; ++v) {
      const std::uint32_t* const row = field.samples() + static_cast<std::ptrdiff_t>(v) * field.width();
      for (int u = first_u; u < last_u + kPerLine; u += kPerLine) __builtin_prefetch(row + u);
    }
  }
}

void align_cells(const GreyView& frame, double full, const PatternField& field, const AlignOptions& options,
                 std::span<CellTask> tasks) {
  for (CellTask& task : tasks) task.patch.failed = false;
  for (std::size_t first = 0; first < tasks.size(); first += kEight) {
    const auto some = tasks.subspan(first, std::min<std::size_t>(kEight, tasks.size() - first));
    std::visit([&](const auto& pixels) { align_some(pixels, full, field, options, some); }, frame);
  }
}

}  // namespace slsd
