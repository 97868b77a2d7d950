// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/clones.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <span>
#include <vector>

#include <gmock/gmock.h>

#include "core/decode/regions/binarize.hpp"
#include "core/decode/regions/sharpen.hpp"
#include "core/decode/symbols/classify.hpp"
#include "core/decode/symbols/weigh_patch.hpp"
#include "core/regions/find_regions.hpp"
#include "tests/core/decode/alone.hpp"
#include "tests/core/decode/decoded_scene.hpp"
#include "tests/core/decode/images.hpp"
#include "tests/core/decode/shipped_pattern.hpp"

namespace slsd {
namespace {

std::string name_of(Clone clone) {
  switch (clone) {
    case Clone::kPlain:
      return "Plain";
    case Clone::kAvx2:
      return "Avx2";
    case Clone::kAvx2Fma:
      return "Avx2Fma";
    case Clone::kAvx512:
      break;
  }
  return "Avx512";
}

/// True if a clone adds to products that are not rounded.
bool fuses(Clone clone) {
  return clone == Clone::kAvx2Fma || clone == Clone::kAvx512;
}

/// What a function gives when a clone is in use.
template <class Function>
auto with(Clone clone, Function&& function) {
  const Clone usual = clone_in_use.exchange(clone);
  auto result = function();
  clone_in_use = usual;
  return result;
}

/// Every clone that this machine can run, against the plain code: numbers that are whole are the same; others are where
/// products are rounded before they are added to, and nearly so where they are not.
class Clones : public testing::TestWithParam<Clone> {
 protected:
  template <class Function>
  void expect_same(Function&& function) const {
    EXPECT_TRUE(with(GetParam(), function) == with(Clone::kPlain, function));
  }
  [[nodiscard]] float tolerance() const { return fuses(GetParam()) ? 1e-5F : 0; }
  void expect_near(float a, float b, float scale = 1) const {
    EXPECT_LE(std::abs(a - b), tolerance() * std::max({std::abs(a), std::abs(b), scale})) << a << ' ' << b;
  }
};

/// Grey values over the whole range, and places where little changes; of a width that fills no register.
template <class T>
Image<T> some_frame(int width, int height, double full) {
  Image<T> frame(width, height);
  std::mt19937 random(7);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double wave = std::sin(0.31 * x + 0.0007 * x * y) * std::cos(0.27 * y);
      const double noise = static_cast<double>(random() % 1000) / 1000;
      frame.at(x, y) = static_cast<T>(full * std::clamp(0.5 + 0.45 * wave + 0.1 * noise, 0., 1.));
    }
  }
  return frame;
}

template <class T>
Mask binarized(const Image<T>& frame, double full, int tile_px) {
  Mask mask;
  Binarizer({.tile_px = tile_px}).binarize(frame.view(), full, mask, alone);
  return mask;
}

TEST_P(Clones, BinarizeAlike) {
  for (const int width : {1, 7, 64, 333}) {
    for (const int tile_px : {4, 5, 12, 30}) {
      expect_same([&] { return binarized(some_frame<std::uint8_t>(width, 101, 255), 255, tile_px); });
      expect_same([&] { return binarized(some_frame<std::uint16_t>(width, 101, 65535), 65535, tile_px); });
    }
  }
}

TEST_P(Clones, MeasureTheSameBlur) {
  expect_same([] {
    const Grey8 frame = some_frame<std::uint8_t>(333, 101, 255);
    Binarizer binarizer({.tile_px = 8});
    Mask mask;
    binarizer.binarize(frame.view(), 255, mask, alone);
    return binarizer.edge_blur_px();
  });
}

TEST_P(Clones, FindTheSameRegions) {
  const Mask mask = binarized(some_frame<std::uint8_t>(700, 90, 255), 255, 6);
  expect_same([&] {
    Regions found;
    RegionFinder().find(mask, found);
    std::vector<int> all;
    for (const slsd::Run& run : found.runs) all.insert(all.end(), {run.row, run.left, run.right});
    for (const Region& region : found.regions) all.insert(all.end(), {region.left, region.top, region.area_px});
    return all;
  });
}

TEST_P(Clones, SharpenAlike) {
  const Grey8 frame = some_frame<std::uint8_t>(333, 41, 255);
  const auto sharpened = [&] { return Sharpener().sharpen(frame.view(), 2.5F, 255); };
  const Grey16 here = with(GetParam(), sharpened), plain = with(Clone::kPlain, sharpened);
  int farthest = 0;
  for (std::size_t i = 0; i < plain.size(); ++i)
    farthest = std::max(farthest, std::abs(here.data()[i] - plain.data()[i]));
  EXPECT_LE(farthest, fuses(GetParam()) ? 1 : 0);
}

TEST_P(Clones, WeighPatchesAlike) {
  constexpr int kHeight = 19;
  std::vector<RowPowers> rows;
  for (int row = 0; row < kHeight; ++row) {
    const auto y = static_cast<float>(row - kHeight / 2);
    rows.push_back({y, y * y, y * y * y});
  }
  std::mt19937 random(5);
  for (const int stride : {8, 16, 40}) {
    std::vector<float> patch;
    for (int i = 0; i < stride * kHeight; ++i)
      patch.push_back(random() % 5 == 0 ? kOutside : static_cast<float>(random() % 256));
    const PatchRange range = range_of(patch.data(), static_cast<int>(patch.size()));
    const auto levels = [&] {
      PatchLevels found;
      find_levels(patch.data(), static_cast<int>(patch.size()), range, found);
      return found;
    };
    const PatchLevels here = with(GetParam(), levels), plain = with(Clone::kPlain, levels);
    expect_near(here.background, plain.background);
    expect_near(here.peak, plain.peak);
    const auto moments = [&] {
      RawMoments sums;
      sum_moments(patch.data(), stride, rows, 0.5F * static_cast<float>(stride - 1), plain, sums);
      return sums;
    };
    const RawMoments sums = with(GetParam(), moments), plain_sums = with(Clone::kPlain, moments);
    for (int p = 0; p <= 3; ++p)
      for (int q = 0; p + q <= 3; ++q) expect_near(sums.m[p][q], plain_sums.m[p][q], plain_sums.m[0][0] * 400);
  }
}

TEST_P(Clones, WeighRegionsAlike) {
  const Grey8 frame = some_frame<std::uint8_t>(700, 90, 255);
  Regions regions;
  RegionFinder().find(binarized(frame, 255, 6), regions);
  std::vector<std::int32_t> all(regions.regions.size());
  std::iota(all.begin(), all.end(), 0);
  ASSERT_GT(all.size(), 20);
  const auto measured = [&] {
    std::vector<GreyMoments> moments(all.size());
    GreyMomentMeter(2).measure_all(frame.view(), regions, all, moments);
    return moments;
  };
  const auto here = with(GetParam(), measured), plain = with(Clone::kPlain, measured);
  for (std::size_t i = 0; i < plain.size(); ++i) {
    EXPECT_EQ(here[i].background, plain[i].background);
    EXPECT_EQ(here[i].peak, plain[i].peak);
    expect_near(here[i].weight, plain[i].weight);
    expect_near(here[i].x, plain[i].x);
    expect_near(here[i].m02, plain[i].m02);
  }
}

TEST_P(Clones, MeasureCellsAlike) {
  const Grey8 frame = some_frame<std::uint8_t>(64, 60, 255);
  const Grey16 wide = sixteen_bits(frame);
  LatticeFrame lattice_frame;
  lattice_frame << 1.3F, 0.2F, -0.1F, 1.1F;
  const auto measured = [&] {
    GreyMomentMeter meter(2);
    const Eigen::Vector2f centre_px(30.3F, 28.6F), shading(0.02F, -0.03F);
    return std::array{meter.measure_cell(frame.view(), centre_px, lattice_frame, 7.F, shading),
                      meter.measure_cell(wide.view(), centre_px, lattice_frame, 7.F, shading)};
  };
  const auto here = with(GetParam(), measured), plain = with(Clone::kPlain, measured);
  for (std::size_t i = 0; i < plain.size(); ++i) {
    ASSERT_GT(plain[i].weight, 0);
    expect_near(here[i].x, plain[i].x);
    expect_near(here[i].y, plain[i].y);
    expect_near(here[i].weight, plain[i].weight);
    expect_near(here[i].m20, plain[i].m20);
  }
}

std::vector<Prototype> any_prototypes(std::mt19937& random) {
  std::normal_distribution<float> normal;
  std::vector<Prototype> prototypes(5);
  for (Prototype& prototype : prototypes) {
    prototype.density = 1;
    for (int i = 0; i < kFeatureCount; ++i) {
      prototype.mean[i] = normal(random);
      for (int j = 0; j < kFeatureCount; ++j) prototype.whitening(i, j) = j <= i ? normal(random) : 0;
    }
  }
  return prototypes;
}

TEST_P(Clones, LookAtEightShapesAsAtEach) {
  constexpr float kNear = 1e-4F, kSizePx = 16;
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  const auto prototypes = any_prototypes(random);
  const Classifier classifier(prototypes, 20);
  EightMoments moments;
  std::array<ShapeFeatures, kLanes> each;
  for (int lane = 0; lane < kLanes; ++lane) {
    GreyMoments one;
    one.weight = 100 + normal(random);
    for (float* moment : {&one.m20, &one.m11, &one.m02}) *moment = 100 * normal(random);
    for (float* moment : {&one.m30, &one.m21, &one.m12, &one.m03}) *moment = 1000 * normal(random);
    const Eigen::Matrix2f map = Eigen::Matrix2f::NullaryExpr([&] { return normal(random); });
    moments.set(lane, one, map);
    each[lane] = shape_features(one, map, kSizePx);
  }
  const auto look = [&] {
    EightShapes shapes;
    find_features(moments, kSizePx, shapes);
    return shapes;
  };
  const EightShapes shapes = with(GetParam(), look);
  for (int lane = 0; lane < kLanes; ++lane)
    for (int i = 0; i < kFeatureCount; ++i)
      EXPECT_NEAR(shapes.of[i][lane], each[lane][i], kNear * (1 + each[lane].norm()));
  for (const std::size_t count : {kLanes, 5}) {
    std::array<Classification, kLanes> classified;
    Classifier::EightDistances squared;
    with(GetParam(), [&] {
      classifier.classify(shapes, std::span(classified).first(count));
      classifier.find_squared_distances(shapes, squared);
      return true;
    });
    for (std::size_t lane = 0; lane < count; ++lane) {
      const Classification plain = with(Clone::kPlain, [&] { return classifier.classify(each[lane]); });
      EXPECT_EQ(classified[lane].letter, plain.letter);
      EXPECT_NEAR(classified[lane].distance, plain.distance, kNear * plain.distance);
      for (std::size_t letter = 0; letter < prototypes.size(); ++letter) {
        EXPECT_NEAR(classified[lane].log_probability[letter], plain.log_probability[letter], 1e-2);
        const float distance = prototypes[letter].squared_distance(each[lane]);
        EXPECT_NEAR(squared.of[letter][lane], distance, 10 * kNear * distance);
      }
    }
    EXPECT_EQ(std::ranges::count_if(classified, [](const Classification& shape) { return shape.likelihood > 0; }),
              static_cast<std::ptrdiff_t>(count));
  }
}

TEST_P(Clones, ClassifyAlike) {
  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  const auto prototypes = any_prototypes(random);
  const Classifier classifier(prototypes, 20);
  for (int n = 0; n < 50; ++n) {
    ShapeFeatures features;
    for (int i = 0; i < kFeatureCount; ++i) features[i] = normal(random);
    const auto classified = [&] { return classifier.classify(features); };
    const Classification here = with(GetParam(), classified), plain = with(Clone::kPlain, classified);
    EXPECT_EQ(here.letter, plain.letter);
    expect_near(here.distance, plain.distance);
    for (std::size_t i = 0; i < prototypes.size(); ++i) expect_near(here.log_probability[i], plain.log_probability[i]);
  }
}

/// @return points of a frame, those of the same cells side by side
std::vector<CloudPoint> points_of(const Pattern& pattern, const GreyView& frame) {
  Decoder decoder = test::decoder_of(pattern);
  return test::decode(decoder, frame).points;
}

TEST_P(Clones, DecodeAlike) {
  const Pattern pattern = shipped_pattern("16px-5.toml");
  const Grey8 sharp = test::frame_of(pattern, test::kCylinder);
  SimulationOptions out_of_focus;
  out_of_focus.blur_sigma_px = 2.5;
  const Grey8 blurred = simulate(draw_pattern(pattern), paper_rig(), test::kTilted, out_of_focus);
  const Grey16 wide = sixteen_bits(sharp);
  for (const GreyView& frame : {GreyView(sharp.view()), GreyView(blurred.view()), GreyView(wide.view())}) {
    const auto decoded = [&] { return points_of(pattern, frame); };
    const auto here = with(GetParam(), decoded), plain = with(Clone::kPlain, decoded);
    ASSERT_GT(plain.size(), 500U);
    ASSERT_EQ(here.size(), plain.size());
    for (std::size_t i = 0; i < plain.size(); ++i) {
      ASSERT_EQ(std::pair(here[i].row, here[i].column), std::pair(plain[i].row, plain[i].column));
      expect_near(here[i].camera_u, plain[i].camera_u);
      expect_near(here[i].camera_v, plain[i].camera_v);
      EXPECT_NEAR(here[i].z, plain[i].z, fuses(GetParam()) ? 0.02 : 0);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(OfThisMachine, Clones, testing::ValuesIn(clones_here()),
                         [](const auto& clone) { return name_of(clone.param); });

TEST(ClonesHere, BeginWithThePlainCodeAndEndWithTheOneInUse) {
  EXPECT_EQ(clones_here().front(), Clone::kPlain);
  EXPECT_EQ(clones_here().back(), clone_in_use.load());
}

}  // namespace
}  // namespace slsd
