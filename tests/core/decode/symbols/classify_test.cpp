// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbols/classify.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <Eigen/LU>

#include "core/decode/symbols/prototypes.hpp"

namespace slsd {
namespace {

constexpr float kDistanceMax = 8;

std::vector<Prototype> three_letters() {
  PrototypeOptions options;
  options.symbols = {7, 22, 25};
  return make_prototypes(options);
}

double total_probability(const Classification& shape, int letters) {
  double sum = 0;
  for (int i = 0; i < letters; ++i) sum += std::exp(static_cast<double>(shape.log_probability[i]));
  return sum;
}

TEST(Classify, KnowsEachPrototype) {
  const auto prototypes = three_letters();
  for (int letter = 0; letter < 3; ++letter) {
    const Classification shape = Classifier(prototypes, kDistanceMax).classify(prototypes[letter].mean);
    EXPECT_EQ(shape.letter, letter);
    EXPECT_EQ(shape.distance, 0);
    EXPECT_GT(shape.log_probability[letter], std::log(0.99));
    EXPECT_NEAR(total_probability(shape, 3), 1, 1e-4);
  }
}

TEST(Classify, RejectsWhatIsLikeNone) {
  const auto prototypes = three_letters();
  ShapeFeatures odd = prototypes[0].mean;
  odd[0] *= 3;
  const Classification shape = Classifier(prototypes, kDistanceMax).classify(odd);
  EXPECT_EQ(shape.letter, -1);
  EXPECT_GT(shape.distance, kDistanceMax);
}

TEST(Classify, TakesWhatIsNoNumberForTorn) {
  const auto prototypes = three_letters();
  for (int i = 0; i < kFeatureCount; ++i) {
    ShapeFeatures unknown = prototypes[0].mean;
    unknown[i] = std::numeric_limits<float>::quiet_NaN();
    const Classification shape = Classifier(prototypes, kDistanceMax).classify(unknown);
    EXPECT_EQ(shape.letter, -1) << i;
    EXPECT_LT(shape.likelihood, 1e-20F) << i;
    EXPECT_TRUE(shape.is_split()) << i;
  }
}

TEST(Classify, MeasuresTheDistanceInStandardDeviations) {
  const auto prototypes = three_letters();
  // Three standard deviations along the fourth whitened axis.
  ShapeFeatures whitened = ShapeFeatures::Zero();
  whitened[3] = 3;
  const ShapeFeatures features = prototypes[1].mean + prototypes[1].whitening.inverse() * whitened;
  EXPECT_NEAR(Classifier(prototypes, kDistanceMax).classify(features).distance, 3, 0.01);
  EXPECT_EQ(Classifier(prototypes, 2.9F).classify(features).letter, -1);
  EXPECT_EQ(Classifier(prototypes, 3.1F).classify(features).letter, 1);
}

TEST(Classify, NamesTheNearestOfOrdinarySamples) {
  const auto prototypes = three_letters();
  std::mt19937 random(2);
  std::normal_distribution<float> normal;
  int right = 0;
  for (int i = 0; i < 300; ++i) {
    const Prototype& prototype = prototypes[i % 3];
    const ShapeFeatures whitened = ShapeFeatures::NullaryExpr([&] { return normal(random); });
    const ShapeFeatures features = prototype.mean + prototype.whitening.inverse() * whitened;
    right += Classifier(prototypes, kDistanceMax).classify(features).letter == i % 3;
  }
  EXPECT_GE(right, 298);
}

TEST(Classify, IsLessSureBetweenTwoPrototypes) {
  const auto prototypes = three_letters();
  const ShapeFeatures between = 0.5F * (prototypes[0].mean + prototypes[1].mean);
  const Classification shape = Classifier(prototypes, 1e3F).classify(between);
  const Classification sure = Classifier(prototypes, 1e3F).classify(prototypes[0].mean);
  EXPECT_LT(shape.log_probability[shape.letter], sure.log_probability[0]);
  EXPECT_NEAR(total_probability(shape, 3), 1, 1e-4);
}

/// One in a hundred is another letter than it seems, and more the less it is like any.
double doubt_at(double distance) {
  return std::clamp(0.01 + 0.12 * (distance - 2), 0.01, 0.5);
}

// Student's t with four degrees of freedom in eight dimensions, one letter after the other, in double precision.
std::vector<double> plain_log_probabilities(const ShapeFeatures& features, const std::vector<Prototype>& prototypes) {
  std::vector<double> likelihood;
  double sum = 0, nearest = 1e9;
  for (const Prototype& prototype : prototypes) {
    const Eigen::VectorXd deviation = (features - prototype.mean).cast<double>();
    const double squared = (prototype.whitening.cast<double>() * deviation).squaredNorm();
    likelihood.push_back(prototype.density * std::pow(1 + squared / 4, -6));
    sum += likelihood.back(), nearest = std::min(nearest, std::sqrt(squared));
  }
  const double doubt = doubt_at(nearest);
  for (double& value : likelihood) {
    value = std::log((1 - doubt) * value / sum + doubt / static_cast<double>(prototypes.size()));
  }
  return likelihood;
}

TEST(Classify, AgreesWithThePlainForm) {
  const auto prototypes = three_letters();
  const Classifier classifier(prototypes, kDistanceMax);
  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  for (int i = 0; i < 300; ++i) {
    const Prototype& prototype = prototypes[i % 3];
    const ShapeFeatures whitened = ShapeFeatures::NullaryExpr([&] { return 2 * normal(random); });
    const ShapeFeatures features = prototype.mean + prototype.whitening.inverse() * whitened;
    const Classification shape = classifier.classify(features);
    const auto plain = plain_log_probabilities(features, prototypes);
    for (int letter = 0; letter < 3; ++letter) {
      EXPECT_NEAR(shape.log_probability[letter], plain[letter], 2e-3) << i;
    }
  }
}

TEST(Classify, KeepsProbabilitiesFiniteForAnyShape) {
  const auto prototypes = three_letters();
  for (const float extreme : {1e4F, 1e8F}) {
    const Classification shape = Classifier(prototypes, kDistanceMax).classify(ShapeFeatures::Constant(extreme));
    EXPECT_EQ(shape.letter, -1);
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(std::isfinite(shape.log_probability[i]));
  }
}

}  // namespace
}  // namespace slsd
