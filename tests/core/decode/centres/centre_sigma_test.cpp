// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/centre_sigma.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include "core/decode/centres/align_symbols.hpp"
#include "tests/core/decode/alone.hpp"
#include "tests/core/decode/decoded_scene.hpp"
#include "tests/core/decode/grid/simulated_grid.hpp"
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

/// A block of cells on a plane, each seen a little beside where it is, and a few far beside.
class JudgedBlock {
 public:
  static constexpr int kSide = 7;

  JudgedBlock() : pattern_(shipped_pattern("16px-5.toml")), cells_(pattern_, flat_prototypes(), rig_.projector) {
    std::mt19937 random(8);
    std::normal_distribution<float> slight(0, 0.08F);
    for (int i = 0; i < kSide * kSide; ++i) {
      const int row = i / kSide, column = i % kSide;
      LatticeSymbol symbol = symbol_of(140 + static_cast<float>(i), 90 + static_cast<float>(i % 11));
      symbol.sighting = i;
      symbol.row = static_cast<std::int16_t>(20 + row), symbol.column = static_cast<std::int16_t>(30 + column);
      symbol.frame *= 1.2F;
      symbol.misfit = 0.5F + 0.15F * static_cast<float>(i * i % 13);
      symbol.centre_px =
          camera_from_projector(cells_.pixel(symbol.row, symbol.column), rig_, plane({0, 0, 2000}, {0, 0, 1}))
              .value()
              .cast<float>();
      symbol.centre_px += Eigen::Vector2f(slight(random), slight(random)) * (i % 9 == 4 ? 6 : 1);
      symbol.neighbours = {column + 1 < kSide ? i + 1 : -1, row + 1 < kSide ? i + kSide : -1, column > 0 ? i - 1 : -1,
                           row > 0 ? i - kSide : -1};
      lattice_.symbols.push_back(symbol);
      GreyMoments& moments = seen_.moments.emplace_back();
      moments.x = symbol.centre_px.x(), moments.y = symbol.centre_px.y();
      seen_.region.push_back(i);
    }
    view_.look_at(seen_, alone);
    across_px_.resize(lattice_.symbols.size()), disparities_px_.resize(lattice_.symbols.size());
    view_.compare(lattice_.symbols, cells_, across_px_, disparities_px_);
    std::vector<float> sorted = across_px_;
    std::ranges::sort(sorted);
    for (float& across : across_px_) across = 1.2F * std::abs(across - sorted[sorted.size() / 2]);
  }

  const std::vector<LatticeSymbol>& judged(const FrameNoise& noise) {
    CentreJudge().judge(noise, &view_, cells_, alone, lattice_);
    return lattice_.symbols;
  }
  /// How far off its epipolar line.
  [[nodiscard]] double across_px(int i) const { return across_px_[i]; }
  /// How far its disparity is beyond those to both sides, more than its neighbours' is.
  [[nodiscard]] double uneven_px(int i) const {
    std::vector<double> around;
    for (const std::int32_t other : neighbours(i)) around.push_back(beyond_px(other));
    std::ranges::sort(around);
    return beyond_px(i) - around[around.size() / 2];
  }
  [[nodiscard]] std::vector<std::int32_t> neighbours(int i) const {
    std::vector<std::int32_t> there;
    for (const std::int32_t other : lattice_.symbols[i].neighbours)
      if (other >= 0) there.push_back(other);
    return there;
  }
  [[nodiscard]] double usual_misfit_squared() const {
    std::vector<float> misfits;
    for (const LatticeSymbol& symbol : lattice_.symbols) misfits.push_back(symbol.misfit * symbol.misfit);
    std::ranges::sort(misfits);
    return misfits[misfits.size() / 2];
  }

 private:
  [[nodiscard]] double beyond_px(int i) const {
    double sum = 0, count = 0;
    const auto& next = lattice_.symbols[i].neighbours;
    for (const auto& [one, other] : {std::pair(next[kLeft], next[kRight]), std::pair(next[kUp], next[kDown])}) {
      if (one < 0 || other < 0) continue;
      const Eigen::Vector2d from = lattice_.symbols[one].centre_px.cast<double>(),
                            to = lattice_.symbols[other].centre_px.cast<double>(),
                            here = lattice_.symbols[i].centre_px.cast<double>();
      const double share = (here - from).dot(to - from) / (to - from).squaredNorm();
      sum += disparities_px_[i] - (1 - share) * disparities_px_[one] - share * disparities_px_[other], ++count;
    }
    return count > 0 ? sum / count : 0;
  }

  Calibration rig_ = paper_rig();
  Pattern pattern_;
  CellRays cells_;
  EpipolarView view_{rig_.cameras[0], rig_.projector, 400, 3200, 1.5};
  Sightings seen_;
  Lattice lattice_;
  std::vector<float> across_px_, disparities_px_;
};

// docs/notes/2026-11-decoder.md derives it; here it is written down once more, term by term.
TEST(CentreJudge, FollowsThePlainFormula) {
  JudgedBlock block;
  const FrameNoise noise{.dark_variance = 4, .variance_per_level = 0.02F};
  const std::vector<LatticeSymbol>& symbols = block.judged(noise);
  const auto square = [](double x) { return x * x; };
  const auto clipped = [&](double px) { return square(std::min(std::abs(px), 0.3)); };
  int rough = 0, uneven = 0;
  for (int i = 0; i < static_cast<int>(symbols.size()); ++i) {
    const LatticeSymbol& symbol = symbols[i];
    const double noise_squared = square(noise_of_centre_px(symbol.weight, symbol.background, symbol.gain, noise));
    double across_squares = square(block.across_px(i)), uneven_squares = square(block.uneven_px(i)), count = 1;
    for (const std::int32_t other : block.neighbours(i))
      across_squares += clipped(block.across_px(other)), uneven_squares += clipped(block.uneven_px(other)), ++count;
    const double roughness = std::max(0., across_squares / count - noise_squared - square(0.03)),
                 unevenness = std::max(0., uneven_squares / count - 2 * noise_squared - square(0.02)),
                 misfit_squared = square(symbol.misfit),
                 beyond = std::max(0., misfit_squared - block.usual_misfit_squared()),
                 least = square(0.01) + (block.neighbours(i).size() == 2 ? square(0.015) : 0);
    rough += roughness > 0, uneven += unevenness > 0;
    EXPECT_NEAR(square(symbol.sigma_px),
                square(0.55) * noise_squared + least + square(0.4 * block.across_px(i)) +
                    square(0.4 * block.uneven_px(i)) + square(0.25) * roughness + square(0.25) * unevenness +
                    std::sqrt(roughness * unevenness) + square(0.01 * beyond),
                1e-5)
        << i;
    EXPECT_NEAR(square(symbol.damage_px),
                noise_squared + least + square(0.35 * block.across_px(i)) + roughness + square(0.018 * misfit_squared),
                1e-5)
        << i;
  }
  EXPECT_GT(rough, 5);
  EXPECT_GT(uneven, 5);
}

TEST(AlignedSigma, IsOfNoiseOfScatterAndOfWhatDisagrees) {
  EXPECT_FLOAT_EQ(aligned_sigma_px(0.04F * 0.04F, 0, 1), 1.1F * 0.04F);
  EXPECT_FLOAT_EQ(aligned_sigma_px(0, 0.05F, 1), 1.2F * 0.05F);
  EXPECT_NEAR(aligned_sigma_px(0, 0, 0.75F), 0.11 * 0.2, 1e-6);
  EXPECT_EQ(aligned_sigma_px(0, 0, 0.96F), 0) << "noise alone leaves that";
  EXPECT_NEAR(aligned_sigma_px(0.04F * 0.04F, 0.05F, 0.75F), std::hypot(std::hypot(0.044, 0.06), 0.022), 1e-6);
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
