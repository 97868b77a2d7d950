// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "core/decode/decoder.hpp"
#include "tests/adversary/frames.hpp"
#include "tests/adversary/report_table.hpp"
#include "tests/adversary/scenes/scene_frames.hpp"

namespace slsd::adversary {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

DepthScene wall(double depth_mm, double tilt_rad = 0) {
  DepthScene scene;
  scene.begin_part(0.8);
  scene.add(Plate{
      {0, 0, depth_mm}, Eigen::AngleAxisd(tilt_rad, Vector3d(1, 1, 0).normalized()).toRotationMatrix(), {1000, 1000}});
  return scene;
}

struct SceneBench : testing::Test {
  Pattern pattern = make_pattern({}).value();
  FrameMaker grid{pattern, pattern.array};
  Calibration rig = grid.calibration();
  SceneFrameMaker maker{pattern, rig};
  Random random{1};

  std::vector<CloudPoint> decode(const Grey8& image) {
    auto decoder = Decoder::create(pattern, rig, 0, {});
    return (*decoder->decode(image.view(), 255))->points;
  }
};

TEST_F(SceneBench, AWallIsSeenAsThroughItsHomography) {
  const SceneTruth truth = look_at(wall(1900, 0.3), rig);
  const Vector3d normal = Eigen::AngleAxisd(0.3, Vector3d(1, 1, 0).normalized()) * Vector3d::UnitZ();
  const Eigen::Matrix3f homography = grid.seen_on_plane(normal, normal.z() * 1900);
  for (int y = 0; y < truth.part.height(); y += 7) {
    for (int x = 0; x < truth.part.width(); x += 7) {
      const Eigen::Vector3f px = homography * Eigen::Vector3f(static_cast<float>(x), static_cast<float>(y), 1);
      EXPECT_NEAR(truth.projector_px.at(x, y)[0], px.x() / px.z(), 2e-3);
      EXPECT_NEAR(truth.projector_px.at(x, y)[1], px.y() / px.z(), 2e-3);
    }
  }
}

// A plate with its right edge on the axis, 1500 mm away, before a wall at 2000 mm.
TEST_F(SceneBench, AnEdgeCastsItsShadowBesideIt) {
  DepthScene scene = wall(2000);
  scene.begin_part(0.5);
  scene.add(Plate{{-500, 0, 1500}, Matrix3d::Identity(), {500, 500}});
  const SceneTruth truth = look_at(scene, rig);
  const Lens& lens = rig.cameras[0].lens;
  const Vector3d projector = rig.cameras[0].projector_from_camera.inverse().translation;
  const double shadow_mm = projector.x() + (0 - projector.x()) * (2000 - projector.z()) / (1500 - projector.z());
  ASSERT_LT(shadow_mm, 0) << "the projector stands on the right: the plate hides its shadow from the camera";
  const int edge = static_cast<int>(std::lround(lens.cx));
  EXPECT_EQ(truth.depth_mm.at(edge - 2, 300), 1500);
  EXPECT_EQ(truth.depth_mm.at(edge + 2, 300), 2000);
  EXPECT_GE(truth.projector_px.at(edge + 2, 300)[0], 0);

  DepthScene other = wall(2000);
  other.begin_part(0.5);
  other.add(Plate{{500, 0, 1500}, Matrix3d::Identity(), {500, 500}});  // with its left edge on the axis
  const SceneTruth dark = look_at(other, rig);
  const double from_px = lens.cx + shadow_mm / 2000 * lens.fx;
  EXPECT_GE(dark.projector_px.at(static_cast<int>(from_px) - 2, 300)[0], 0);
  for (int x = static_cast<int>(from_px) + 2; x < edge - 1; ++x) {
    EXPECT_EQ(dark.depth_mm.at(x, 300), 2000);
    EXPECT_LT(dark.projector_px.at(x, 300)[0], 0) << x;
  }
}

TEST_F(SceneBench, RoundShapesAndHolesAreWhereTheyAre) {
  DepthScene scene = wall(2000);
  scene.begin_part(0.5);
  scene.add(Ball{{0, 0, 1800}, 100});
  scene.begin_part(0.5);
  scene.add(Tube{{-500, -100, 1700}, {500, -100, 1700}, 20});
  scene.begin_part(0.5);
  scene.add(Plate{{0, 0, 1900}, Matrix3d::Identity(), {1000, 1000}, Outline::kHoles, 30, 200});
  const SceneTruth truth = look_at(scene, rig);
  const Lens& lens = rig.cameras[0].lens;
  const auto depth_at = [&](double x_mm, double y_mm, double z_mm) {
    const Eigen::Vector2d px = lens.project({x_mm, y_mm, z_mm});
    return truth.depth_mm.at(static_cast<int>(std::lround(px.x())), static_cast<int>(std::lround(px.y())));
  };
  EXPECT_NEAR(depth_at(0, 0, 1700), 1700, 0.1) << "the ball's front";
  EXPECT_NEAR(depth_at(60, 0, 1720), 1720, 0.5) << "the ball's flank";
  EXPECT_NEAR(depth_at(0, -100, 1680), 1680, 2) << "the tube";
  EXPECT_NEAR(depth_at(-200, 0, 1900), 2000, 1e-3) << "through a hole, at the wall";
  EXPECT_NEAR(depth_at(-165, 0, 1900), 1900, 1e-3) << "beside the hole";
  EXPECT_NEAR(depth_at(-100, 100, 1900), 1900, 1e-3) << "between the rows of holes";
}

TEST_F(SceneBench, APlainWallIsReadAndItsPointsAreRight) {
  const SceneFrame frame = maker.take(wall(1900, 0.2), {.blur_px = 0.8}, random);
  const SceneVerdict verdict = maker.judge(frame.truth, decode(frame.image));
  EXPECT_EQ(verdict.wrong, 0);
  EXPECT_EQ(verdict.in_the_air, 0);
  EXPECT_GT(verdict.visible, 600);
  EXPECT_GT(verdict.decoded, verdict.visible * 95 / 100);
}

TEST_F(SceneBench, TheJudgeTellsWrongPointsFromThoseInTheAir) {
  const SceneFrame frame = maker.take(wall(1900), {.blur_px = 0.8}, random);
  const std::vector<CloudPoint> right = decode(frame.image);
  ASSERT_GT(right.size(), 500U);
  const auto judged = [&](int columns, float nearer_mm) {
    std::vector<CloudPoint> points = right;
    for (CloudPoint& point : points)
      point.column = static_cast<std::uint16_t>(point.column + columns), point.z -= nearer_mm;
    return maker.judge(frame.truth, points);
  };
  const int all = static_cast<int>(right.size());
  EXPECT_EQ(judged(1, 60).wrong, all);
  EXPECT_EQ(judged(1, 60).wrong_points.size(), right.size());
  EXPECT_EQ(judged(1, 20).in_the_air, all) << "another cell, but near the surface";
  EXPECT_EQ(judged(0, 60).in_the_air, all) << "the right cell in the wrong place";
  EXPECT_EQ(judged(0, 9).in_the_air, all);
  EXPECT_EQ(judged(0, 0).right, all);
}

TEST_F(SceneBench, SymbolsBehindAnEdgeAreNotVisible) {
  const auto count = [&](const DepthScene& scene) {
    return std::ranges::count(maker.visible_symbols(look_at(scene, rig)), true);
  };
  DepthScene wired = wall(1900);
  wired.begin_part(0.5);
  // Thinner than a symbol, and across the middles of a row of them: all four corners remain.
  const double v = pattern.symbol_centre_v_px(22);
  const double y_mm = (v - rig.projector.cy) / rig.projector.fy * 1860;
  wired.add(Tube{{-500, y_mm, 1899}, {500, y_mm, 1899}, 3});
  const auto whole = count(wall(1900)), left = count(wired);
  EXPECT_GT(whole, 600);
  EXPECT_LT(left, whole - 25);
  EXPECT_GT(left, whole - 70);
}

TEST_F(SceneBench, TheRoomLightsWhatTheProjectorDoesNot) {
  DepthScene scene = wall(2000);
  scene.begin_part(0.8);
  scene.add(Plate{{0, 0, 1500}, Matrix3d::Identity(), {60, 60}});
  const SceneFrame dark = maker.take(scene, {}, random), lit = maker.take(scene, {.room = 0.5}, random);
  int shadow = 0;
  for (int y = 0; y < dark.image.height(); ++y) {
    for (int x = 0; x < dark.image.width(); ++x) {
      if (dark.truth.projector_px.at(x, y)[0] >= 0 || dark.image.at(x, y) > 20) continue;
      ++shadow;
      EXPECT_GT(lit.image.at(x, y), 40);
    }
  }
  EXPECT_GT(shadow, 1000);
  const auto clipped = [&](double gain) {
    const Grey8 image = maker.take(wall(1900), {.gain = gain}, random).image;
    return std::count(image.data(), image.data() + image.size(), 255);
  };
  EXPECT_EQ(clipped(0.8), 0);
  EXPECT_GT(clipped(2), 50000);
}

TEST_F(SceneBench, CleanLightShowsTheSameScene) {
  const SceneFrame any = maker.make(4, 2), clean = maker.make(4, 2, true);
  EXPECT_EQ(any.truth.depth_mm, clean.truth.depth_mm);
  EXPECT_FALSE(any.image == clean.image);
  const SceneVerdict verdict = maker.judge(clean.truth, decode(clean.image));
  EXPECT_GT(verdict.decoded, verdict.visible / 2);
}

TEST_F(SceneBench, AFrameOfOneNumberIsTheSameTwice) {
  for (int kind = 0; kind < static_cast<int>(scene_kinds().size()); ++kind) {
    const SceneFrame once = maker.make(kind, 3), again = maker.make(kind, 3);
    EXPECT_EQ(once.image, again.image) << scene_kinds()[kind].name;
    EXPECT_EQ(once.truth.depth_mm, again.truth.depth_mm) << scene_kinds()[kind].name;
  }
  EXPECT_FALSE(maker.make(0, 3).truth.depth_mm == maker.make(0, 4).truth.depth_mm);
}

// Every scene fills the camera's image and lies within the decoders' working depths; every kind has jumps in depth.
TEST_F(SceneBench, EveryKindHasEdgesInDepth) {
  constexpr std::uint32_t kFrames = 3;
  for (int kind = 0; kind < static_cast<int>(scene_kinds().size()); ++kind) {
    int jumps = 0, beyond = 0, lit = 0, pixels = 0;
    for (std::uint32_t number = 0; number < kFrames; ++number) {
      const SceneTruth truth = maker.make(kind, number).truth;
      pixels += static_cast<int>(truth.part.size());
      for (int y = 1; y < truth.part.height(); ++y) {
        for (int x = 1; x < truth.part.width(); ++x) {
          const float depth = truth.depth_mm.at(x, y);
          jumps +=
              std::abs(depth - truth.depth_mm.at(x - 1, y)) > 10 || std::abs(depth - truth.depth_mm.at(x, y - 1)) > 10;
          beyond += depth < 1500 || depth > 2500;
          lit += truth.projector_px.at(x, y)[0] >= 0;
        }
      }
    }
    EXPECT_GT(jumps, 300 * kFrames) << scene_kinds()[kind].name;
    EXPECT_LT(beyond, pixels / 50) << scene_kinds()[kind].name;
    EXPECT_GT(lit, pixels / 3) << scene_kinds()[kind].name;
  }
}

TEST(SceneKinds, KeptOutOnesAreDrawnOnRequestOnly) {
  const std::vector<int> open = drawn_scene_kinds({}), kept = drawn_scene_kinds({.kept_out = true});
  for (const int index : open) EXPECT_FALSE(scene_kinds()[index].kept_out);
  for (const int index : kept) EXPECT_TRUE(scene_kinds()[index].kept_out);
  EXPECT_GE(kept.size(), 4U);
  EXPECT_EQ(open.size() + kept.size(), scene_kinds().size());
  EXPECT_EQ(drawn_grid_kinds({}).size(), static_cast<std::size_t>(kKinds));
  EXPECT_TRUE(drawn_grid_kinds({.kept_out = true}).empty());
  for (const int index : kept) {
    const int kind = number_of_scene_kind(index);
    EXPECT_TRUE(drawn_scene_kinds({.only_kind = kind}).empty()) << "a kept-out kind needs --kept-out";
    EXPECT_EQ(drawn_scene_kinds({.only_kind = kind, .kept_out = true}), std::vector<int>{index});
  }
}

}  // namespace
}  // namespace slsd::adversary
