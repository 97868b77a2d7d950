// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/classify.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace slsd {
namespace {

constexpr float kDegreesOfFreedom = 4;
constexpr float kFarthestSquared = 1e5F;  // farther than that all are equally unlikely, and a float's range ends
constexpr float kLeastProbability = 1e-6F;

/// The shape of Student's t in kFeatureCount dimensions: (1 + d^2 / nu)^(-(nu + 8) / 2), nu = 4.
float student_t(float squared_distance) {
  static_assert(kFeatureCount == 8);
  const float t = 1 + std::min(squared_distance, kFarthestSquared) / kDegreesOfFreedom;
  const float cubed = t * t * t;
  return 1 / (cubed * cubed);
}

}  // namespace

Classification classify(const ShapeFeatures& features, const std::vector<Prototype>& prototypes, float distance_max) {
  Classification result;
  std::array<float, kMaxLetters> likelihood;
  float nearest = std::numeric_limits<float>::max(), best = 0, sum = 0;
  int letter = -1;
  for (std::size_t i = 0; i < prototypes.size(); ++i) {
    const float squared = prototypes[i].squared_distance(features);
    nearest = std::min(nearest, squared);
    likelihood[i] = prototypes[i].density * student_t(squared);
    sum += likelihood[i];
    if (likelihood[i] > best) best = likelihood[i], letter = static_cast<int>(i);
  }
  for (std::size_t i = 0; i < prototypes.size(); ++i) {
    result.log_probability[i] = std::log(std::max(likelihood[i] / sum, kLeastProbability));
  }
  result.distance = std::sqrt(nearest);
  if (result.distance <= distance_max) result.letter = static_cast<std::int8_t>(letter);
  return result;
}

}  // namespace slsd
