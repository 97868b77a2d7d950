// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/centre_sigma.hpp"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include "tests/core/decode/alone.hpp"
#include "tests/core/decode/decoded_scene.hpp"
#include "tests/core/decode/shipped_pattern.hpp"

namespace slsd {
namespace {

LatticeSymbol symbol_of(float weight, float gain) {
  LatticeSymbol symbol{};
  symbol.weight = weight, symbol.background = 20, symbol.gain = gain;
  symbol.frame.setIdentity();
  symbol.neighbours = {0, 0, 0, 0};
  return symbol;
}

TEST(NoiseOfCentre, FollowsNoiseOverContrast) {
  const FrameNoise six{.dark_variance = 36}, twelve{.dark_variance = 144};
  EXPECT_NEAR(noise_of_centre_px(144, 20, 100, six), 6 / 60. / std::sqrt(12), 1e-6);
  EXPECT_NEAR(noise_of_centre_px(144, 20, 200, twelve), 6 / 60. / std::sqrt(12), 1e-6);
  EXPECT_LT(noise_of_centre_px(600, 20, 100, six), noise_of_centre_px(144, 20, 100, six));
}

/// The last of several.
float judged(const std::vector<LatticeSymbol>& symbols) {
  const Pattern pattern = shipped_pattern("16px-5.toml");
  const CellRays cells(pattern, std::vector<Prototype>(5), paper_rig().projector);
  Lattice lattice{symbols};
  CentreJudge().judge({}, nullptr, cells, alone, lattice);
  return lattice.symbols.back().sigma_px;
}

TEST(CentreJudge, KnowsEachOfMany) {
  const Pattern pattern = shipped_pattern("16px-5.toml");
  const CellRays cells(pattern, std::vector<Prototype>(5), paper_rig().projector);
  const FrameNoise noise{.dark_variance = 9, .variance_per_level = 0.02F};
  for (const int count : {1, 64, 65, 200}) {
    Lattice lattice;
    for (int i = 0; i < count; ++i) {
      LatticeSymbol& symbol =
          lattice.symbols.emplace_back(symbol_of(90 + static_cast<float>(i), 60 + static_cast<float>(i % 7)));
      symbol.misfit = i % 5 == 4 ? 3 : 1;
      if (i % 3 == 0) symbol.neighbours = {i, i, -1, -1};
    }
    CentreJudge().judge(noise, nullptr, cells, alone, lattice);
    for (const LatticeSymbol& symbol : lattice.symbols) {
      const double noise_px = noise_of_centre_px(symbol.weight, symbol.background, symbol.gain, noise),
                   unbent_px = symbol.neighbours[2] < 0 ? 0.015 : 0, misfit = symbol.misfit * symbol.misfit - 1;
      EXPECT_NEAR(symbol.sigma_px, std::hypot(std::hypot(0.55 * noise_px, 0.01), std::hypot(unbent_px, 0.01 * misfit)),
                  1e-6);
    }
  }
}

TEST(CentreJudge, GrowsWithTheMisfitOfTheShapeAndWhereNothingTellsOfItsBend) {
  LatticeSymbol symbol = symbol_of(144, 100);
  symbol.misfit = 1;
  const LatticeSymbol usual = symbol;
  EXPECT_NEAR(judged({usual, usual, symbol}), 0.01, 1e-6);
  symbol.misfit = 2;
  EXPECT_NEAR(judged({usual, usual, symbol}), std::hypot(0.01, 0.01 * (4 - 1)), 1e-6);
  symbol.misfit = 1;
  symbol.neighbours = {0, 0, -1, -1};
  EXPECT_NEAR(judged({usual, usual, symbol}), std::hypot(0.01, 0.015), 1e-6);
}

/// Standard deviation of errors over sigma, and the root mean square of the errors, on a plane whose place is known.
struct Truth {
  double over_sigma, rms_mm;
};

Truth truth_of(Precision precision, double noise, const Surface& surface, std::size_t points_min = 2000) {
  const Pattern pattern = shipped_pattern("16px-5.toml");
  DecodeOptions options;
  options.precision = precision;
  Decoder decoder = test::decoder_of(pattern, options);
  SimulationOptions simulation;
  simulation.noise_sigma = noise;
  const Grey8 frame = simulate(draw_pattern(pattern), paper_rig(), surface, simulation);
  const Decoding decoding = test::decode(decoder, frame.view());
  EXPECT_GT(decoding.points.size(), points_min);
  double squares = 0, in_sigma = 0;
  const Lens lens = paper_rig().cameras[0].lens;
  for (const CloudPoint& point : decoding.points) {
    const Eigen::Vector3d at(point.x, point.y, point.z);
    const Eigen::Vector3d direction = lens.undistort(lens.project(at)).homogeneous();
    const auto true_depth = surface({Eigen::Vector3d::Zero(), direction});
    if (!true_depth) continue;
    const double error = (at.z() - *true_depth) * direction.norm();
    squares += error * error;
    in_sigma += std::pow(error / point.sigma_mm, 2);
  }
  const auto count = static_cast<double>(decoding.points.size());
  return {std::sqrt(in_sigma / count), std::sqrt(squares / count)};
}

// The truth is known: sigma tripled, or a third of it, is out of bounds.
TEST(Sigma, IsTrueAtEveryNoise) {
  for (const double noise : {2.0, 6.0}) {
    for (const Precision precision : {Precision::kStandard, Precision::kFine}) {
      const Truth truth = truth_of(precision, noise, test::kTilted);
      EXPECT_GT(truth.over_sigma, 0.55) << noise << " " << static_cast<int>(precision);
      EXPECT_LT(truth.over_sigma, 1.5) << noise << " " << static_cast<int>(precision);
    }
  }
}

TEST(Sigma, WithoutNoiseIsNotTooSmall) {
  for (const Precision precision : {Precision::kStandard, Precision::kFine})
    EXPECT_LT(truth_of(precision, 0, test::kTilted).over_sigma, 1.5);
}

/// A plate of waves.
Surface waves(double period_mm, double height_mm, double at_mm = 2000) {
  return [=](const Ray& ray) -> std::optional<double> {
    double depth_mm = at_mm;
    for (int i = 0; i < 4; ++i) {
      const Eigen::Vector3d at = ray.origin + (depth_mm - ray.origin.z()) / ray.direction.z() * ray.direction;
      const double per_mm = 2 * std::numbers::pi / period_mm;
      depth_mm = at_mm + 0.5 * height_mm * std::sin(per_mm * at.x()) * std::sin(per_mm * at.y());
    }
    return (depth_mm - ray.origin.z()) / ray.direction.z();
  };
}

// Relief that symbols cannot follow sets neighbours off each other.
TEST(Sigma, OfCentresFollowsReliefBelowTheSymbols) {
  const Truth truth = truth_of(Precision::kStandard, 2, waves(34, 4));
  EXPECT_GT(truth.over_sigma, 0.55);
  EXPECT_LT(truth.over_sigma, 1.3);
}

// Near the devices the same relief is larger in disparity, but symbols follow it: with twice the factor of unevenness
// alone the errors would be 0.54 sigma.
TEST(Sigma, OfCentresIsNotForReliefThatSymbolsFollow) {
  EXPECT_GT(truth_of(Precision::kStandard, 2, waves(80, 8, 500), 1000).over_sigma, 0.6);
}

// Relief that a patch cannot follow scatters within it, and sigma knows two thirds of what that does. With twice the
// scatter's factor the errors would be 1.0 sigma, with half of it 2.0, without it 2.7.
TEST(Sigma, OfFinePatchesFollowsReliefWithinThem) {
  const Truth truth = truth_of(Precision::kFine, 2, waves(34, 4));
  EXPECT_GT(truth.over_sigma, 1.25);
  EXPECT_LT(truth.over_sigma, 1.75);
}

TEST(Precision, FineIsSeveralTimesAsExact) {
  const Truth standard = truth_of(Precision::kStandard, 2, test::kTilted),
              fine = truth_of(Precision::kFine, 2, test::kTilted);
  EXPECT_LT(fine.rms_mm, 0.6 * standard.rms_mm);
  EXPECT_LT(fine.rms_mm, 0.1);
}

TEST(Precision, FineTakesNoCentroidsThePapersWay) {
  DecodeOptions options;
  options.precision = Precision::kFine;
  EXPECT_TRUE(options.validate());
  options.centre = Method::kPaper;
  const auto refused = options.validate();
  ASSERT_FALSE(refused);
  EXPECT_THAT(to_string(refused.error()), testing::HasSubstr("leave centre at"));
}

}  // namespace
}  // namespace slsd
