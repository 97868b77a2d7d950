// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/classify.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace slsd {
namespace {

constexpr float kDegreesOfFreedom = 5;

}  // namespace

Classification classify(const ShapeFeatures& features, const std::vector<Prototype>& prototypes, float distance_max) {
  Classification result;
  float squared_least = std::numeric_limits<float>::max(), best = -squared_least;
  int letter = -1;
  for (std::size_t i = 0; i < prototypes.size(); ++i) {
    const Prototype& prototype = prototypes[i];
    const float squared = (prototype.whitening * (features - prototype.mean)).squaredNorm();
    result.log_probability[i] =
        -0.5F * (kDegreesOfFreedom + kFeatureCount) * std::log1p(squared / kDegreesOfFreedom) - prototype.log_volume;
    squared_least = std::min(squared_least, squared);
    if (result.log_probability[i] > best) best = result.log_probability[i], letter = static_cast<int>(i);
  }
  float sum = 0;
  for (std::size_t i = 0; i < prototypes.size(); ++i) sum += std::exp(result.log_probability[i] - best);
  const float normaliser = best + std::log(sum);
  for (std::size_t i = 0; i < prototypes.size(); ++i) result.log_probability[i] -= normaliser;
  result.distance = std::sqrt(squared_least);
  if (result.distance <= distance_max) result.letter = static_cast<std::int8_t>(letter);
  return result;
}

}  // namespace slsd
