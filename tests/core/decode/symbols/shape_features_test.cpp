// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbols/shape_features.hpp"

#include <cmath>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>
#include <Eigen/LU>

namespace slsd {
namespace {

// Moments of points of equal weight that stand for an area.
GreyMoments moments_of(const std::vector<Eigen::Vector2d>& points, double area) {
  Eigen::Vector2d mean(0, 0);
  for (const Eigen::Vector2d& p : points) mean += p / static_cast<double>(points.size());
  double sums[4][4] = {};
  for (const Eigen::Vector2d& p : points) {
    const Eigen::Vector2d d = p - mean;
    for (int i = 0; i < 4; ++i) {
      for (int k = 0; k + i < 4; ++k)
        sums[i][k] += std::pow(d.x(), i) * std::pow(d.y(), k) / static_cast<double>(points.size());
    }
  }
  const auto f = [&](int i, int k) { return static_cast<float>(sums[i][k]); };
  GreyMoments m;
  m.x = static_cast<float>(mean.x()), m.y = static_cast<float>(mean.y()), m.weight = static_cast<float>(area);
  m.m20 = f(2, 0), m.m11 = f(1, 1), m.m02 = f(0, 2);
  m.m30 = f(3, 0), m.m21 = f(2, 1), m.m12 = f(1, 2), m.m03 = f(0, 3);
  return m;
}

struct Scene {
  std::vector<Eigen::Vector2d> points;
  Eigen::Matrix2d frame, map;
};

Eigen::Matrix2d random_map(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  Eigen::Matrix2d map;
  do {
    map << 1.5 * uniform(random), 1.5 * uniform(random), 1.5 * uniform(random), 1.5 * uniform(random);
  } while (std::abs(map.determinant()) < 0.3);
  return map;
}

Scene random_scene(std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-8, 8);
  Scene scene;
  for (int i = 0; i < 30; ++i) scene.points.emplace_back(place(random), place(random) * 0.5 + 2);
  scene.frame = random_map(random);
  scene.map = random_map(random);
  return scene;
}

RC_GTEST_PROP(ShapeFeatures, DoNotChangeWhenImageAndFrameAreMappedTogether, ()) {
  const Scene scene = random_scene(*rc::gen::arbitrary<std::uint32_t>());
  std::vector<Eigen::Vector2d> mapped;
  for (const Eigen::Vector2d& p : scene.points) mapped.emplace_back(scene.map * p + Eigen::Vector2d(30, -7));
  const Eigen::Matrix2f inverse = scene.frame.inverse().cast<float>();
  const Eigen::Matrix2f mapped_inverse = (scene.map * scene.frame).inverse().cast<float>();
  const ShapeFeatures before = shape_features(moments_of(scene.points, 100), inverse, 16);
  const ShapeFeatures after =
      shape_features(moments_of(mapped, 100 * std::abs(scene.map.determinant())), mapped_inverse, 16);
  RC_ASSERT((after - before).norm() < 2e-3F * (1 + before.norm()));
}

TEST(ShapeFeatures, OfAFullSquareAreThoseOfTheUnitSquare) {
  GreyMoments square;
  square.weight = 400;
  square.m20 = square.m02 = 400.F / 12;
  const ShapeFeatures features = shape_features(square, 0.8F * Eigen::Matrix2f::Identity(), 16);
  EXPECT_NEAR(features[0], 1, 1e-5);
  EXPECT_NEAR(features[1], 1. / 12, 1e-6);
  EXPECT_NEAR(features[2], 0, 1e-6);
  EXPECT_NEAR(features[3], 1. / 12, 1e-6);
  EXPECT_NEAR(features.tail<4>().norm(), 0, 1e-6);
}

TEST(ShapeFeatures, TurnWithAMirror) {
  const Scene scene = random_scene(4);
  Eigen::Matrix2f mirror;
  mirror << -1, 0, 0, 1;
  const GreyMoments moments = moments_of(scene.points, 100);
  const ShapeFeatures seen = shape_features(moments, Eigen::Matrix2f::Identity(), 16);
  const ShapeFeatures mirrored = shape_features(moments, mirror, 16);
  const Eigen::Array<float, kFeatureCount, 1> signs{1, 1, -1, 1, -1, 1, -1, 1};
  EXPECT_TRUE(mirrored.isApprox((seen.array() * signs).matrix(), 1e-5F));
}

}  // namespace
}  // namespace slsd
