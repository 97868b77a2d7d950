// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbols/appearance.hpp"

#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

namespace slsd {
namespace {

constexpr float kCameraScale = 1.4F;

PatternOptions options() {
  PatternOptions options;
  options.symbols = {9, 11, 13, 18, 19};
  return options;
}

std::vector<ShapeFeatures> shapes_at(float blur_px, float scale = kCameraScale) {
  std::vector<ShapeFeatures> shapes;
  for (const Prototype& prototype : make_prototypes({.symbols = options().symbols,
                                    .symbol_size_px = options().symbol_size_px,
                                    .spacing_px = options().spacing_px,
                                    .camera_px_per_projector_px = scale,
                                    .frame_error = 0.01F,
                                    .blur_px = blur_px})) {
    shapes.push_back(prototype.mean);
  }
  return shapes;
}

std::vector<ShapeFeatures> many_shapes_at(float blur_px, float scale = kCameraScale) {
  const std::vector<ShapeFeatures> few = shapes_at(blur_px, scale);
  std::vector<ShapeFeatures> many;
  for (int i = 0; i < 5; ++i) many.insert(many.end(), few.begin(), few.end());
  return many;
}

class Blurs : public testing::TestWithParam<float> {};

// Each appearance is of blurs to a third, so that those beside it know the same shapes.
TEST_P(Blurs, AreToldByTheShapesToOneStep) {
  const Appearances appearances(options(), kCameraScale);
  EXPECT_NEAR(std::log(*appearances.likeliest(many_shapes_at(GetParam())).blur_px / GetParam()), 0, std::log(1.6));
}

INSTANTIATE_TEST_SUITE_P(Appearances, Blurs, testing::Values(0.7F, 1.0F, 1.4F, 2.0F));

TEST(Appearances, OfFewShapesIsTheUsual) {
  const Appearances appearances(options(), kCameraScale);
  EXPECT_EQ(&appearances.likeliest({}), &appearances.usual());
  EXPECT_EQ(&appearances.likeliest(shapes_at(1)), &appearances.usual());
  EXPECT_FALSE(appearances.usual().blur_px);
}

// One object that lies before all else must not decide.
TEST(Appearances, OfAFrameAreThoseOfMostShapes) {
  const Appearances appearances(options(), kCameraScale);
  std::vector<ShapeFeatures> shapes = many_shapes_at(0.7F);
  for (int i = 0; i < 2; ++i)
    for (const ShapeFeatures& blurred : shapes_at(2)) shapes.push_back(blurred);
  EXPECT_LE(appearances.likeliest(shapes).blur_px, 1);
}

// In a camera of twice the pixels symbols are larger, and so is their blur.
TEST(Appearances, OfLargerSymbolsAreOfLargerBlurs) {
  constexpr float kBlurPx = 3.7F;
  const Appearances appearances(options(), 2 * kCameraScale);
  EXPECT_NEAR(std::log(*appearances.likeliest(many_shapes_at(kBlurPx, 2 * kCameraScale)).blur_px / kBlurPx), 0,
              std::log(1.2));
}

TEST(Appearances, AreSharedForTheSameSymbolsAtTheSameScale) {
  const auto known = std::make_shared<const Appearances>(options(), kCameraScale);
  PatternOptions reseeded = options(), of_others = options();
  ++reseeded.seed;
  of_others.symbols.back() = of_others.symbols.back() == 5 ? 7 : 5;
  EXPECT_EQ(Appearances::shared(options(), kCameraScale, known), known);
  EXPECT_EQ(Appearances::shared(reseeded, kCameraScale, known), known);
  EXPECT_NE(Appearances::shared(of_others, kCameraScale, known), known);
  EXPECT_NE(Appearances::shared(options(), 1.1F * kCameraScale, known), known);
  EXPECT_NE(Appearances::shared(options(), kCameraScale, nullptr), nullptr);
}

// A calibration in micrometres predicts symbols of thousands of pixels: drawing those would take minutes.
TEST(Appearances, OfHugeSymbolsAreThoseOfTheLargestDrawn) {
  const auto made = std::make_shared<const Appearances>(options(), 1e6F);
  for (const float scale : {6.F, 6.1F, 1e4F, std::numeric_limits<float>::infinity(), std::nanf("")}) {
    EXPECT_EQ(Appearances::shared(options(), scale, made), made) << scale;
  }
}

TEST(Appearances, AreMadeOnce) {
  const Appearances appearances(options(), kCameraScale);
  const auto shapes = many_shapes_at(1);
  EXPECT_EQ(&appearances.likeliest(shapes), &appearances.likeliest(shapes));
}

}  // namespace
}  // namespace slsd
