// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/appearance/align_eight.hpp"

#include <array>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "core/clones.hpp"
#include "core/code/pattern.hpp"
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

void expect_same(const PatchTask& task, const PatchFit& fit, float grey = 1) {
  ASSERT_TRUE(fit.solved);
  ASSERT_FALSE(task.failed);
  EXPECT_NEAR(task.state.disparity, fit.state.disparity, 2e-3);
  EXPECT_NEAR(task.state.slope_x, fit.state.slope_x, 5e-4);
  EXPECT_NEAR(task.state.slope_y, fit.state.slope_y, 5e-4);
  EXPECT_NEAR(task.state.across, fit.state.across, 5e-4);
  EXPECT_NEAR(task.state.gain, fit.state.gain, 0.05 * grey);
  EXPECT_NEAR(task.state.gain_x, fit.state.gain_x, 0.02 * grey);
  EXPECT_NEAR(task.state.gain_y, fit.state.gain_y, 0.02 * grey);
  EXPECT_NEAR(task.state.offset, fit.state.offset, 0.05 * grey);
  EXPECT_NEAR(task.residual, fit.residual, 0.02 * fit.residual);
  EXPECT_EQ(task.pixels, fit.pixels);
  EXPECT_NEAR(task.support, fit.support, 0.002);
  EXPECT_NEAR(task.variance, fit.covariance(0, 0), 0.01F * fit.covariance(0, 0));
  const float of_slopes = 0.5F * (fit.covariance(1, 1) + fit.covariance(2, 2));
  EXPECT_NEAR(task.slope_variance, of_slopes, 0.01F * of_slopes);
}

PatchFit fit(const GreyView& frame, double full, const PatchTask& start, int side, int steps) {
  AlignOptions of_steps = options();
  of_steps.steps = steps;
  PatchAligner aligner(of_steps);
  const PatchWindow window{start.x - side / 2, start.y - side / 2, side, side};
  return std::visit(
      [&](const auto& pixels) {
        return aligner.align(pixels, full, start.noise, blurred_field(), start.map, window, start.state);
      },
      frame);
}

PatchFit one_step(const GreyView& frame, double full, const PatchTask& start, int side = kSide) {
  return fit(frame, full, start, side, 1);
}

TEST(AlignEight, IsAStepOfTheAlignerOfSymbols) {
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
      const PatchFit fit = one_step(seen().frame.view(), 255, starts[i], side);
      SCOPED_TRACE(testing::Message() << side << " px, task " << i);
      ASSERT_NE(tasks[i].failed, fit.solved);
      if (fit.solved) expect_same(tasks[i], fit);
    }
  }
}

// On what is bent the ninths lie off the plane, once it has come to rest: the thirds of a row are summed up apart.
TEST(AlignEight, ScattersAsTheAlignerOfSymbolsDoes) {
  constexpr int kSteps = 6;
  const Seen bent{.surface = cylinder({0, 0, 2150}, {0.2, 1, 0}, 150)};
  for (const int side : {45, 65}) {
    PatchTask start = bent.task(785, 600, 0);
    std::array<PatchTask, 1> tasks{start};
    for (int step = 0; step < kSteps; ++step) align(bent.frame.view(), 255, tasks, side);
    const PatchFit plain = fit(bent.frame.view(), 255, start, side, kSteps);
    ASSERT_TRUE(plain.solved);
    EXPECT_GT(plain.scatter, 0) << side;
    EXPECT_NEAR(tasks[0].scatter, plain.scatter, 0.02F * plain.scatter) << side;
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

TEST(AlignEight, SaturatedPixelsDoNotCount) {
  const PatchTask start = seen().task(750, 520, 0.1F);
  std::array<PatchTask, 1> tasks{start};
  align(seen().frame.view(), 150, tasks);
  EXPECT_LT(tasks[0].pixels, kSide * kSide - 5);
  expect_same(tasks[0], one_step(seen().frame.view(), 150, start));
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

}  // namespace
}  // namespace slsd
