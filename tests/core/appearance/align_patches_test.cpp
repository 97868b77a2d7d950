// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/appearance/align_patches.hpp"

#include <array>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "core/clones.hpp"
#include "core/code/pattern.hpp"
#include "tests/core/appearance/plain_step.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

constexpr int kSide = 21;
constexpr float kNoise = 2;

const PatternField& blurred_field() {
  static const PatternField made(
      draw_pattern(make_pattern({.symbols = {11, 13, 14, 18, 19}, .method = ArrayMethod::kConstructive}).value())
          .view(),
      0.72F);
  return made;
}

/// A plane that the paper's rig sees, with noise.
struct Seen {
  Calibration rig = paper_rig();
  Surface surface = plane({0, 0, 2000}, {0.3, 0.15, -1});
  Grey8 frame = simulate(
      draw_pattern(make_pattern({.symbols = {11, 13, 14, 18, 19}, .method = ArrayMethod::kConstructive}).value()), rig,
      surface, {});

  /// What is fitted around a pixel, from a start that is off.
  [[nodiscard]] PatchTask task(int x, int y, float off_px) const {
    const CalibratedCamera& camera = rig.cameras[0];
    const Eigen::Vector2d middle(x, y);
    const double depth = *surface({Eigen::Vector3d::Zero(), camera.lens.undistort(middle).homogeneous()});
    PatchTask task;
    task.x = x, task.y = y, task.noise = kNoise;
    task.map =
        make_patch_map(pixel_ray(camera.lens, middle), middle, camera.projector_from_camera, rig.projector, depth);
    task.state.disparity = off_px;
    task.state.gain = 170, task.state.gain_x = 0.5F, task.state.offset = 25;
    return task;
  }
  [[nodiscard]] std::array<PatchTask, kEight> tasks() const {
    std::array<PatchTask, kEight> tasks;
    for (int i = 0; i < kEight; ++i) tasks[i] = task(700 + 23 * i, 500 + 17 * i, 0.05F * static_cast<float>(i - 4));
    return tasks;
  }
};

const Seen& seen() {
  static const Seen made;
  return made;
}

AlignOptions options() {
  AlignOptions options;
  options.gain_slope_sigma = 0.02F;
  return options;
}

template <std::size_t kCount>
void align(const GreyView& frame, double full, std::array<PatchTask, kCount>& tasks, int side = kSide) {
  std::vector<PatchTask*> all;
  for (PatchTask& task : tasks) all.push_back(&task);
  align_eight(frame, full, blurred_field(), options(), side, all);
}

void expect_same(const PatchTask& task, const test::PlainStep& step, float grey = 1) {
  ASSERT_TRUE(step.solved);
  ASSERT_FALSE(task.failed);
  EXPECT_NEAR(task.state.disparity, step.state.disparity, 2e-3);
  EXPECT_NEAR(task.state.slope_x, step.state.slope_x, 5e-4);
  EXPECT_NEAR(task.state.slope_y, step.state.slope_y, 5e-4);
  EXPECT_NEAR(task.state.across, step.state.across, 5e-4);
  EXPECT_NEAR(task.state.gain, step.state.gain, 0.05 * grey);
  EXPECT_NEAR(task.state.gain_x, step.state.gain_x, 0.02 * grey);
  EXPECT_NEAR(task.state.gain_y, step.state.gain_y, 0.02 * grey);
  EXPECT_NEAR(task.state.offset, step.state.offset, 0.05 * grey);
  EXPECT_NEAR(task.residual, step.residual, 0.02 * step.residual);
  EXPECT_NEAR(task.pixels, step.pixels, 1e-5 * step.pixels);
  EXPECT_NEAR(task.support, step.support, 0.002);
  EXPECT_NEAR(task.variance, step.covariance(0, 0), 0.01 * step.covariance(0, 0));
  const double of_slopes = 0.5 * (step.covariance(1, 1) + step.covariance(2, 2));
  EXPECT_NEAR(task.slope_variance, of_slopes, 0.01 * of_slopes);
}

/// A window whose every pixel counts.
CellTask window_of(const PatchTask& patch, int side) {
  return {.patch = patch, .window_px = side, .square_half_px = 1e6F};
}

test::PlainStep one_step(const GreyView& frame, double full, const PatchTask& start, int side = kSide) {
  return std::visit(
      [&](const auto& pixels) {
        return test::plain_step(pixels, full, blurred_field(), options(), window_of(start, side));
      },
      frame);
}

TEST(AlignEight, IsAStepOfThePlainForm) {
  const std::array<PatchTask, kEight> starts = seen().tasks();
  std::array<PatchTask, kEight> tasks = starts;
  align(seen().frame.view(), 255, tasks);
  for (int i = 0; i < kEight; ++i) expect_same(tasks[i], one_step(seen().frame.view(), 255, starts[i]));
}

// Rows are summed up in parts of 32 pixels; 65 are three, and the thirds end within the first and the second.
TEST(AlignEight, WindowsMayBeOfAnySize) {
  const std::array<PatchTask, kEight> starts = seen().tasks();
  for (const int side : {11, 31, 33, 65, 97}) {
    std::array<PatchTask, kEight> tasks = starts;
    align(seen().frame.view(), 255, tasks, side);
    for (int i = 0; i < kEight; ++i) {
      const test::PlainStep step = one_step(seen().frame.view(), 255, starts[i], side);
      SCOPED_TRACE(testing::Message() << side << " px, task " << i);
      ASSERT_NE(tasks[i].failed, step.solved);
      if (step.solved) expect_same(tasks[i], step);
    }
  }
}

// On what is bent the ninths lie off the plane, once it has come to rest: the thirds of a row are summed up apart.
TEST(AlignEight, ScattersAsThePlainFormDoes) {
  constexpr int kSteps = 6;
  const Seen bent{.surface = cylinder({0, 0, 2150}, {0.2, 1, 0}, 150)};
  for (const int side : {45, 65}) {
    const PatchTask start = bent.task(785, 600, 0);
    std::array<PatchTask, 1> tasks{start};
    test::PlainStep plain{.state = start.state};
    for (int step = 0; step < kSteps; ++step) {
      align(bent.frame.view(), 255, tasks, side);
      PatchTask at = start;
      at.state = plain.state;
      plain = one_step(bent.frame.view(), 255, at, side);
    }
    ASSERT_TRUE(plain.solved);
    EXPECT_GT(plain.scatter, 0) << side;
    EXPECT_NEAR(tasks[0].scatter, plain.scatter, 0.02 * plain.scatter) << side;
  }
}

TEST(AlignEight, ComesToRestWhereTheSurfaceIs) {
  std::array<PatchTask, kEight> tasks = seen().tasks();
  for (int step = 0; step < 3; ++step) align(seen().frame.view(), 255, tasks);
  for (const PatchTask& task : tasks) {
    EXPECT_LT(std::abs(task.moved), 0.01);  // pixels that count less come to rest slowly
    EXPECT_LT(std::abs(task.state.disparity), 5 * std::sqrt(task.variance) * task.residual + 0.01F);
  }
}

TEST(AlignEight, FindsTheLightWhereNoneIsKnown) {
  std::array<PatchTask, kEight> known = seen().tasks(), unknown = known;
  for (PatchTask& task : unknown) task.state.gain = task.state.gain_x = task.state.offset = 0;
  for (int step = 0; step < 4; ++step) align(seen().frame.view(), 255, known), align(seen().frame.view(), 255, unknown);
  for (int i = 0; i < kEight; ++i) {
    EXPECT_NEAR(unknown[i].state.disparity, known[i].state.disparity, 0.003);
    EXPECT_NEAR(unknown[i].state.gain, known[i].state.gain, 1);
  }
}

/// The frame through a sensor that is full at a level.
Grey8 clipped_at(std::uint8_t full) {
  Grey8 frame = seen().frame;
  for (int y = 0; y < frame.height(); ++y)
    for (int x = 0; x < frame.width(); ++x) frame.at(x, y) = std::min(frame.at(x, y), full);
  return frame;
}

TEST(AlignEight, SaturatedPixelsCountAsInThePlainForm) {
  for (const int full : {150, 80}) {
    const Grey8 frame = clipped_at(static_cast<std::uint8_t>(full));
    PatchTask start = seen().task(750, 520, 0.1F);
    for (int step = 0; step < 4; ++step) {
      std::array<PatchTask, 1> tasks{start};
      align(frame.view(), full, tasks);
      expect_same(tasks[0], one_step(frame.view(), full, start));
      start.state = tasks[0].state;
    }
  }
}

TEST(AlignEight, ClippingMakesNoErrorBeyondSigma) {
  const Grey8 frame = clipped_at(90);
  std::array<PatchTask, kEight> tasks = seen().tasks();
  for (int step = 0; step < 6; ++step) align(frame.view(), 90, tasks);
  for (const PatchTask& task : tasks) {
    ASSERT_FALSE(task.failed);
    EXPECT_GT(task.support, 0.8F);
    EXPECT_LT(std::abs(task.state.disparity), 5 * std::sqrt(task.variance) * task.residual + 0.01F);
  }
}

TEST(AlignEight, SixteenBitsAreTheSame) {
  Grey16 frame(seen().frame.width(), seen().frame.height());
  for (int y = 0; y < frame.height(); ++y)
    for (int x = 0; x < frame.width(); ++x) frame.at(x, y) = static_cast<std::uint16_t>(257 * seen().frame.at(x, y));
  PatchTask start = seen().task(750, 520, 0.1F);
  start.noise *= 257, start.state.gain *= 257, start.state.gain_x *= 257, start.state.offset *= 257;
  std::array<PatchTask, 1> tasks{start};
  align(frame.view(), 65535, tasks);
  expect_same(tasks[0], one_step(frame.view(), 65535, start), 257);
}

TEST(AlignEight, FewerGiveTheSame) {
  std::array<PatchTask, kEight> eight = seen().tasks();
  std::array<PatchTask, 3> three{eight[0], eight[1], eight[2]};
  align(seen().frame.view(), 255, eight), align(seen().frame.view(), 255, three);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(three[i].state.disparity, eight[i].state.disparity);
}

TEST(AlignEight, NothingThereFails) {
  const Grey8 flat(1600, 1200, 90);
  std::array<PatchTask, 1> tasks{seen().task(750, 520, 0)};
  tasks[0].state.gain = 0;
  align(flat.view(), 255, tasks);
  EXPECT_TRUE(tasks[0].failed);
}

TEST(AlignEight, ClonesAgree) {
  std::array<PatchTask, kEight> plain = seen().tasks();
  const Clone usual = clone_in_use.exchange(Clone::kPlain);
  align(seen().frame.view(), 255, plain);
  for (const Clone clone : clones_here()) {
    clone_in_use = clone;
    std::array<PatchTask, kEight> tasks = seen().tasks();
    align(seen().frame.view(), 255, tasks);
    for (int i = 0; i < kEight; ++i) {
      EXPECT_NEAR(tasks[i].state.disparity, plain[i].state.disparity, clone == Clone::kAvx2 ? 0 : 1e-4);
      EXPECT_NEAR(tasks[i].scatter, plain[i].scatter, clone == Clone::kAvx2 ? 0 : 1e-4);
    }
  }
  clone_in_use = usual;
}

/// A cell of the pattern around what the pixel sees, on a bent surface.
CellTask cell_at(int x, int y, float off_px) {
  CellTask cell{.patch = seen().task(x, y, off_px), .window_px = 31, .square_half_px = 9.3F};
  PatchState& state = cell.patch.state;
  state.bend_xx = 2e-3F, state.bend_xy = -1e-3F, state.bend_yy = 5e-4F;
  const Eigen::Vector2f middle = projector_offset(cell.patch.map, state, {0.3F, -0.6F});
  cell.square_middle_px = middle + cell.patch.map.origin_px.cast<float>();
  return cell;
}

void expect_same(const CellTask& task, const test::PlainStep& step) {
  expect_same(task.patch, step);
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      EXPECT_NEAR(task.covariance(row, column), step.covariance(row, column),
                  0.01 * std::sqrt(step.covariance(row, row) * step.covariance(column, column)))
          << row << column;
}

AlignOptions one_step_options() {
  AlignOptions one = options();
  one.steps = 1;
  return one;
}

TEST(AlignCells, AreStepsOfThePlainForm) {
  std::vector<CellTask> starts;
  for (int i = 0; i < 11; ++i) starts.push_back(cell_at(650 + 23 * i, 450 + 17 * i, 0.03F * static_cast<float>(i - 5)));
  std::vector<CellTask> tasks = starts;
  align_cells(seen().frame.view(), 255, blurred_field(), one_step_options(), tasks);
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    SCOPED_TRACE(i);
    const auto plain = test::plain_step(seen().frame.view(), 255, blurred_field(), options(), starts[i]);
    EXPECT_LT(plain.pixels, 0.9 * 31 * 31) << "the square is smaller than the window";
    expect_same(tasks[i], plain);
  }
}

// What the last step changes is known for the middle of each ninth alone, so the steps have to come to rest.
TEST(AlignCells, ScatterAsThePlainFormDoes) {
  AlignOptions many = options();
  many.steps = 8;
  for (int i = 0; i < 4; ++i) {
    CellTask start = cell_at(650 + 23 * i, 450 + 17 * i, 0);
    std::array<CellTask, 1> tasks{start};
    align_cells(seen().frame.view(), 255, blurred_field(), many, tasks);
    test::PlainStep plain{.state = start.patch.state};
    for (int step = 0; step < many.steps; ++step) {
      start.patch.state = plain.state;
      plain = test::plain_step(seen().frame.view(), 255, blurred_field(), options(), start);
    }
    EXPECT_GT(plain.scatter, 0.003) << i;
    EXPECT_NEAR(tasks[0].patch.scatter, plain.scatter, 0.05 * plain.scatter) << i;
  }
}

// The corner of a crop sees what the whole frame sees there; windows reach beyond it on two sides.
TEST(AlignCells, MayReachBeyondTheFrame) {
  constexpr int kLeft = 700, kTop = 500, kWide = 40, kHigh = 30;
  Grey8 crop(kWide, kHigh);
  for (int y = 0; y < kHigh; ++y)
    for (int x = 0; x < kWide; ++x) crop.at(x, y) = seen().frame.at(kLeft + x, kTop + y);
  for (const auto& [x, y] : {std::pair(4, 6), std::pair(kWide - 5, kHigh - 4)}) {
    CellTask start = cell_at(kLeft + x, kTop + y, 0.02F);
    start.patch.x = x, start.patch.y = y;
    std::array<CellTask, 1> tasks{start};
    align_cells(crop.view(), 255, blurred_field(), one_step_options(), tasks);
    const auto plain = test::plain_step(crop.view(), 255, blurred_field(), options(), start);
    ASSERT_NE(tasks[0].patch.failed, plain.solved);
    if (plain.solved) expect_same(tasks[0], plain);
  }
}

TEST(AlignCells, KeepTheStateOfTheLastGoodStep) {
  CellTask start = cell_at(750, 520, 0);
  start.square_half_px = 0.5F;  // too few pixels
  std::array<CellTask, 1> tasks{start};
  align_cells(seen().frame.view(), 255, blurred_field(), options(), tasks);
  EXPECT_TRUE(tasks[0].patch.failed);
  EXPECT_EQ(tasks[0].patch.state.disparity, start.patch.state.disparity);
  EXPECT_EQ(tasks[0].patch.state.gain, start.patch.state.gain);
}

}  // namespace
}  // namespace slsd
