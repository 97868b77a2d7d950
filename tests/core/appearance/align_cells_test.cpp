// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/appearance/align_patches.hpp"

#include <array>
#include <functional>
#include <random>

#include <gmock/gmock.h>
#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "core/code/pattern.hpp"
#include "tests/core/appearance/plain_light.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

constexpr float kBlurPx = 0.7F;
constexpr double kDark = 20, kGain = 150;
constexpr int kReach = 16;  // of the window from its centre, px

const Grey8& pattern() {
  static const Grey8 image = draw_pattern(make_pattern({}).value());
  return image;
}
const PatternField& field() {
  static const PatternField made(pattern().view(), kBlurPx);
  return made;
}

/// A plane's inverse depth, in 1/mm, at a camera pixel and its change for one px.
struct TruePlane {
  double at_middle, per_x, per_y;
};

/// A patch of the paper's rig, 33 px wide, that sees a plane.
struct Scene {
  Calibration rig = paper_rig();
  Eigen::Vector2i centre{801, 541};
  TruePlane plane{1 / 2000.0, 2e-8, -1e-8};

  explicit Scene(double distortion = 0) {
    rig.cameras[0].lens.distortion = {distortion, -distortion, 0.0005, 0, 0};
    rig.projector.distortion = {0.5 * distortion, 0, 0, -0.0005, 0};
  }
  [[nodiscard]] const CalibratedCamera& camera() const { return rig.cameras[0]; }
  [[nodiscard]] double inverse_depth(const Eigen::Vector2d& off) const {
    return plane.at_middle + plane.per_x * off.x() + plane.per_y * off.y();
  }
  /// Through both lenses as they are.
  [[nodiscard]] Eigen::Vector2d lit_by(const Eigen::Vector2d& off, double inverse_depth) const {
    const Eigen::Vector3d direction = camera().lens.undistort(middle() + off).homogeneous();
    return rig.projector.project(camera().projector_from_camera * (direction / inverse_depth));
  }
  [[nodiscard]] PatchMap map(double reference_mm = 2003) const {
    return make_patch_map(pixel_ray(camera().lens, middle()), middle(), camera().projector_from_camera, rig.projector,
                          reference_mm);
  }
  [[nodiscard]] Eigen::Vector2d middle() const { return centre.cast<double>(); }
  /// Calls visit(x, y) for every pixel of the window.
  template <class Visit>
  void visit_window(Visit&& visit) const {
    for (int y = centre.y() - kReach; y <= centre.y() + kReach; ++y)
      for (int x = centre.x() - kReach; x <= centre.x() + kReach; ++x) visit(x, y);
  }
  [[nodiscard]] double true_disparity(const PatchMap& map) const {
    return (plane.at_middle - map.reference_inverse_depth) / map.inverse_depth_per_px;
  }
  /// The frame: what the camera sees in the window, and black elsewhere.
  using Light = std::function<double(const Eigen::Vector2d& off, double light)>;
  [[nodiscard]] Grey16 frame(const Light& light, double noise = 0, unsigned seed = 1) const {
    Grey16 frame(1600, 1200);
    std::mt19937 random(seed);
    std::normal_distribution<double> gauss(0, 1);
    visit_window([&](int x, int y) {
      const Eigen::Vector2d off = Eigen::Vector2d(x, y) - middle();
      const Eigen::Vector2d p = lit_by(off, inverse_depth(off));
      const double grey = light(off, test::plain_light(pattern(), kBlurPx, p.x(), p.y())) + noise * gauss(random);
      // A fraction of a level, so that rounding is no noise.
      frame.at(x, y) = static_cast<std::uint16_t>(std::lround(std::clamp(64 * grey, 0.0, 65535.0)));
    });
    return frame;
  }
  [[nodiscard]] Grey16 seen(double noise = 0, unsigned seed = 1) const {
    return frame([](const Eigen::Vector2d&, double light) { return kDark + kGain * light; }, noise, seed);
  }
};

CellTask align(const Scene& scene, const GreyView& frame, const PatchState& start = {}, float noise = 2,
               AlignOptions options = {}, double full = 65535) {
  std::array<CellTask, 1> tasks{CellTask{.window_px = 2 * kReach + 1, .square_half_px = 1e6F}};
  PatchTask& patch = tasks[0].patch;
  patch.x = scene.centre.x(), patch.y = scene.centre.y();
  patch.map = scene.map(), patch.noise = 64 * noise, patch.state = start;
  align_cells(frame, full, field(), options, tasks);
  return tasks[0];
}

/// The same by the plainest means: both lenses as they are, the pattern integrated, derivatives from differences,
/// double precision, without regard to outliers.
double plain_disparity(const Scene& scene, const Grey16& frame) {
  using Parameters = Eigen::Matrix<double, 8, 1>;
  const PatchMap map = scene.map();
  const Eigen::Vector2d normal(-map.along.y(), map.along.x());
  const auto model = [&](const Parameters& q, const Eigen::Vector2d& off) {
    const double disparity = q[0] + q[1] * off.x() + q[2] * off.y();
    const double inverse = map.reference_inverse_depth + disparity * map.inverse_depth_per_px;
    const Eigen::Vector2d p = scene.lit_by(off, inverse) + q[3] * normal;
    return (q[4] + q[5] * off.x() + q[6] * off.y()) * test::plain_light(pattern(), kBlurPx, p.x(), p.y()) + q[7];
  };
  Parameters q;
  q << 0, 0, 0, 0, kGain, 0, 0, kDark;
  const double steps[8] = {1e-4, 1e-5, 1e-5, 1e-4, 1e-2, 1e-3, 1e-3, 1e-2};
  for (int step = 0; step < 6; ++step) {
    Eigen::Matrix<double, 8, 8> normal_matrix = Eigen::Matrix<double, 8, 8>::Zero();
    Parameters right = Parameters::Zero();
    scene.visit_window([&](int x, int y) {
      const Eigen::Vector2d off = Eigen::Vector2d(x, y) - scene.middle();
      Parameters row;
      for (int k = 0; k < 8; ++k) {
        Parameters more = q, less = q;
        more[k] += steps[k], less[k] -= steps[k];
        row[k] = (model(more, off) - model(less, off)) / (2 * steps[k]);
      }
      normal_matrix += row * row.transpose();
      right += row * (frame.at(x, y) / 64.0 - model(q, off));
    });
    q += normal_matrix.ldlt().solve(right);
  }
  return q[0];
}

TEST(AlignCellOfAPlane, MapIsThatOfBothLenses) {
  const Scene scene(0.2);
  const PatchMap map = scene.map();
  for (const double mm : {1950.0, 2003.0, 2050.0}) {
    PatchState state;
    state.disparity = static_cast<float>((1 / mm - map.reference_inverse_depth) / map.inverse_depth_per_px);
    const Eigen::Vector2d p = scene.lit_by({7, -9}, 1 / mm);
    const Eigen::Vector2f off = camera_offset(map, state, (p - map.origin_px.cast<double>()).cast<float>());
    EXPECT_NEAR(off.x(), 7, 0.02) << mm;
    EXPECT_NEAR(off.y(), -9, 0.02) << mm;
  }
}

TEST(AlignCellOfAPlane, GoesToTheProjectorAndBack) {
  const PatchMap map = Scene(0.2).map();
  PatchState state;
  state.disparity = 1.5F, state.slope_x = 0.03F, state.slope_y = -0.02F, state.across = 0.4F;
  state.bend_xx = 4e-4F, state.bend_xy = -3e-4F, state.bend_yy = 6e-4F;
  for (const Eigen::Vector2f& off : {Eigen::Vector2f(0, 0), Eigen::Vector2f(11, -8), Eigen::Vector2f(-9, 12)}) {
    const Eigen::Vector2f back = camera_offset(map, state, projector_offset(map, state, off));
    EXPECT_NEAR(back.x(), off.x(), 2e-3);
    EXPECT_NEAR(back.y(), off.y(), 2e-3);
  }
}

TEST(AlignCellOfAPlane, FindsThePlane) {
  for (const double distortion : {0.0, -0.25}) {
    const Scene scene(distortion);
    const CellTask fit = align(scene, scene.seen().view());
    ASSERT_FALSE(fit.patch.failed);
    const double unit = scene.map().inverse_depth_per_px;
    EXPECT_NEAR(fit.patch.state.disparity, scene.true_disparity(scene.map()), 0.003);
    EXPECT_NEAR(fit.patch.state.slope_x, scene.plane.per_x / unit, 0.0006);
    EXPECT_NEAR(fit.patch.state.slope_y, scene.plane.per_y / unit, 0.0006);
    EXPECT_NEAR(fit.patch.state.across, 0, 0.003);
    EXPECT_NEAR(fit.patch.state.gain / 64, kGain, 1);
    EXPECT_NEAR(fit.patch.state.offset / 64, kDark, 1);
    EXPECT_GT(fit.patch.support, 0.98);
    EXPECT_LT(fit.patch.residual / 64, 1);
  }
}

TEST(AlignCellOfAPlane, AgreesWithThePlainForm) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const Scene scene(-0.2);
    const Grey16 frame = scene.seen(2, seed);
    AlignOptions options;
    options.outlier_sigmas = 1000, options.across_sigma_px = 100;
    const CellTask fit = align(scene, frame.view(), {}, 2, options);
    ASSERT_FALSE(fit.patch.failed);
    EXPECT_NEAR(fit.patch.state.disparity, plain_disparity(scene, frame), 0.002) << seed;
  }
}

TEST(AlignCellOfAPlane, PullsInFromHalfAPixel) {
  const Scene scene;
  const Grey16 frame = scene.seen(2);
  for (const float off : {-0.6F, 0.6F}) {
    PatchState start;
    start.disparity = static_cast<float>(scene.true_disparity(scene.map())) + off;
    AlignOptions options;
    options.steps = 6;
    EXPECT_NEAR(align(scene, frame.view(), start, 2, options).patch.state.disparity, scene.true_disparity(scene.map()),
                0.03);
  }
}

TEST(AlignCellOfAPlane, ShadingDoesNotPull) {
  const Scene scene;
  const Grey16 frame = scene.frame([](const Eigen::Vector2d& off, double light) {
    return kDark + kGain * light * (1 + 0.02 * off.x() - 0.01 * off.y());
  });
  const CellTask fit = align(scene, frame.view());
  EXPECT_NEAR(fit.patch.state.disparity, scene.true_disparity(scene.map()), 0.004);
  EXPECT_NEAR(fit.patch.state.gain_x / fit.patch.state.gain, 0.02, 0.002);
  EXPECT_NEAR(fit.patch.state.gain_y / fit.patch.state.gain, -0.01, 0.002);
}

TEST(AlignCellOfAPlane, BendIsTakenAsGiven) {
  Scene scene;
  const PatchMap map = scene.map();
  PatchState bent;
  bent.bend_xx = -0.002F, bent.bend_xy = 0.0005F, bent.bend_yy = 0.001F;
  Grey16 frame(1600, 1200);
  scene.visit_window([&](int x, int y) {
    const Eigen::Vector2d off = Eigen::Vector2d(x, y) - scene.middle();
    const double bend =
        0.5 * (bent.bend_xx * off.x() * off.x() + bent.bend_yy * off.y() * off.y()) + bent.bend_xy * off.x() * off.y();
    const Eigen::Vector2d p = scene.lit_by(off, scene.inverse_depth(off) + bend * map.inverse_depth_per_px);
    const double light = test::plain_light(pattern(), kBlurPx, p.x(), p.y());
    frame.at(x, y) = static_cast<std::uint16_t>(std::lround(64 * (kDark + kGain * light)));
  });
  EXPECT_NEAR(align(scene, frame.view(), bent).patch.state.disparity, scene.true_disparity(map), 0.004);
  EXPECT_GT(std::abs(align(scene, frame.view()).patch.state.disparity - scene.true_disparity(map)), 0.008);
}

TEST(AlignCellOfAPlane, ErrorsAreAsLargeAsTheCovarianceSays) {
  for (const double noise : {2.0, 6.0}) {
    Eigen::Vector3d squares = Eigen::Vector3d::Zero();
    double residuals = 0;
    constexpr int kFrames = 60;
    for (int i = 0; i < kFrames; ++i) {
      Scene scene;
      scene.centre = {790 + i / 3, 541 - i / 5};
      scene.plane.at_middle = 1 / (1980 + 0.7 * i);
      const CellTask fit = align(scene, scene.seen(noise, 100 + i).view(), {}, static_cast<float>(noise));
      ASSERT_FALSE(fit.patch.failed);
      const PatchMap map = scene.map();
      const Eigen::Vector3d truth(scene.true_disparity(map), scene.plane.per_x / map.inverse_depth_per_px,
                                  scene.plane.per_y / map.inverse_depth_per_px);
      const PatchState& found = fit.patch.state;
      const Eigen::Vector3d error = Eigen::Vector3d(found.disparity, found.slope_x, found.slope_y) - truth;
      const double variance = fit.patch.residual * fit.patch.residual;
      squares.array() += error.array().square() / (fit.covariance.diagonal().cast<double>().array() * variance);
      residuals += fit.patch.residual / 64 / kFrames;
    }
    EXPECT_NEAR(residuals, noise, 0.15 * noise);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(std::sqrt(squares[k] / kFrames), 1, 0.3) << noise << ", unknown " << k;
  }
}

TEST(AlignCellOfAPlane, WhatIsCutOffDoesNotPullAndShows) {
  const Scene scene;
  const auto cut = [](const Eigen::Vector2d& off, double light) { return kDark + (off.x() > 7 ? 0 : kGain * light); };
  PatchState start;
  const CellTask whole = align(scene, scene.seen(2).view());
  start.gain = whole.patch.state.gain, start.offset = whole.patch.state.offset;
  start.disparity = static_cast<float>(scene.true_disparity(scene.map())) + 0.05F;
  const CellTask fit = align(scene, scene.frame(cut, 2).view(), start);
  ASSERT_FALSE(fit.patch.failed);
  EXPECT_NEAR(fit.patch.state.disparity, scene.true_disparity(scene.map()), 0.06);
  EXPECT_LT(fit.patch.support, 0.93);
  EXPECT_GT(whole.patch.support, 0.95);
  EXPECT_GT(fit.covariance(0, 0), 1.3 * whole.covariance(0, 0));
}

TEST(AlignCellOfAPlane, ReliefWithinThePatchScatters) {
  Scene scene;
  Grey16 frame(1600, 1200);
  scene.visit_window([&](int x, int y) {
    const Eigen::Vector2d off = Eigen::Vector2d(x, y) - scene.middle();
    const double wave = 0.15 * std::sin(0.45 * off.x()) * scene.map().inverse_depth_per_px;
    const Eigen::Vector2d p = scene.lit_by(off, scene.inverse_depth(off) + wave);
    frame.at(x, y) = static_cast<std::uint16_t>(
        std::lround(64 * (kDark + kGain * test::plain_light(pattern(), kBlurPx, p.x(), p.y()))));
  });
  EXPECT_LT(align(scene, scene.seen(0).view()).patch.scatter, 0.006);
  EXPECT_GT(align(scene, frame.view()).patch.scatter, 0.018);
}

TEST(AlignCellOfAPlane, SaturatedPixelsMayBeAnyBrighter) {
  const Scene scene;
  const Grey16 clipped =
      scene.frame([](const Eigen::Vector2d&, double light) { return std::min(kDark + 2 * kGain * light, 200.0); });
  const auto aligned = [&](double full) { return align(scene, clipped.view(), {}, 2, {}, full); };
  const CellTask fit = aligned(64 * 200), taken_as_seen = aligned(65535);
  ASSERT_FALSE(fit.patch.failed);
  EXPECT_EQ(fit.patch.pixels, taken_as_seen.patch.pixels);
  EXPECT_GT(fit.patch.support, 0.95F);
  EXPECT_LT(fit.patch.residual, 0.5F * taken_as_seen.patch.residual);
  EXPECT_NEAR(fit.patch.state.gain / 64, 2 * kGain, 0.05 * 2 * kGain);
  EXPECT_NEAR(fit.patch.state.disparity, scene.true_disparity(scene.map()), 0.01);
}

TEST(AlignCellOfAPlane, NothingThereFails) {
  const Scene scene;
  EXPECT_TRUE(align(scene, scene.frame([](auto&, double) { return kDark; }).view()).patch.failed);
  const Grey16 inverted = scene.frame([](auto&, double light) { return kDark + kGain * (1 - light); });
  EXPECT_TRUE(align(scene, inverted.view()).patch.failed);
  Scene small;
  small.centre = {4, 4};
  EXPECT_TRUE(align(small, Grey16(8, 8, 99).view()).patch.failed);
}

}  // namespace
}  // namespace slsd
