// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbols/classify.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/clones.hpp"
#include "core/lanes.hpp"

namespace slsd {
namespace {

static_assert(kMaxLetters == kLanes && kFeatureCount == 8);
constexpr float kDegreesOfFreedom = 4;
constexpr float kFarthestSquared = 1e5F;  // farther than that all are equally unlikely, and a float's range ends
constexpr float kAbsent = 1e12F;

/// How often a shape is another letter than the likeliest for what the prototypes do not know: cut at an edge, torn,
/// run together, printed on. It grows with the distance from the nearest prototype. Measured on drawn and rendered
/// frames: docs/decoder.md has the table.
constexpr float kDoubtMin = 0.01F, kDoubtMax = 0.5F;
constexpr float kDoubtFrom = 2, kDoubtSlope = 0.12F;

struct Verdict {
  Lanes log_probability;
  float nearest, best;  // squared distance from the nearest prototype, and the greatest likelihood
  unsigned likeliest;   // a bit to each letter that has it
};

/// Natural logarithms of positive numbers to 1e-6: the exponent's, and the mantissa's, which lies within a root of two
/// from one, by the series of 2 artanh.
inline __attribute__((always_inline)) void take_logarithms(const Lanes& of, Lanes& logarithms) {
  constexpr int kRootOfHalf = 0x3F3504F3, kExponentUnit = 1 << 23;
  constexpr float kLogTwo = 0.69314718F;
  const IntLanes bits = reinterpret_cast<IntLanes>(of);
  const IntLanes exponent = (bits - kRootOfHalf) >> 23;
  const Lanes mantissa = reinterpret_cast<Lanes>(bits - exponent * kExponentUnit);
  const Lanes s = (mantissa - 1) / (mantissa + 1), ss = s * s;
  logarithms = __builtin_convertvector(exponent, Lanes) * kLogTwo +
               2 * s * (1 + ss * (1 / 3.F + ss * (1 / 5.F + ss * (1 / 7.F + ss * (1 / 9.F)))));
}

/// Of the whitened features from one on. The triangle's rows have no one length, so none is a loop.
template <int kRow>
inline __attribute__((always_inline)) void add_squares(const Classifier::Table& table, const Lanes* deviation,
                                                       Lanes& squared_distance) {
  if constexpr (kRow < kFeatureCount) {
    Lanes whitened{};
    for (int j = 0; j <= kRow; ++j) {
      Lanes weight;
      load(table.whitening[kRow][j], weight);
      whitened += weight * deviation[j];
    }
    squared_distance += whitened * whitened;
    add_squares<kRow + 1>(table, deviation, squared_distance);
  }
}

inline __attribute__((always_inline)) void judge(const Classifier::Table& table, const float* features,
                                                 Verdict& verdict) {
  const Lanes zero{};
  Lanes deviation[kFeatureCount];
  for (int i = 0; i < kFeatureCount; ++i) {
    Lanes mean;
    load(table.mean[i], mean);
    deviation[i] = features[i] - mean;
  }
  Lanes squared_distance, density;
  load(table.absent, squared_distance);
  load(table.density, density);
  add_squares<0>(table, deviation, squared_distance);
  // Student's t in eight dimensions: (1 + d^2 / nu)^(-(nu + 8) / 2), nu = 4.
  const Lanes farthest = zero + kFarthestSquared;
  const Lanes squared = squared_distance < farthest ? squared_distance : farthest;
  const Lanes t = 1 + squared / kDegreesOfFreedom, cubed = t * t * t;
  const Lanes likelihood = density / (cubed * cubed);
  const float nearest = least_of(squared_distance);
  const float doubt = std::clamp(kDoubtMin + kDoubtSlope * (std::sqrt(nearest) - kDoubtFrom), kDoubtMin, kDoubtMax);
  const Lanes probability = likelihood * ((1 - doubt) / sum_of(likelihood)) + doubt * table.share;
  take_logarithms(probability, verdict.log_probability);
  verdict.nearest = nearest;
  verdict.best = -least_of(-likelihood);
  verdict.likeliest = bits_of(likelihood == verdict.best);
}

}  // namespace

Classifier::Classifier(const std::vector<Prototype>& prototypes, float distance_max)
    : table_{}, distance_max_(distance_max) {
  table_.share = 1 / static_cast<float>(prototypes.size());
  for (float& absent : table_.absent) absent = kAbsent;
  for (std::size_t letter = 0; letter < prototypes.size(); ++letter) {
    const Prototype& prototype = prototypes[letter];
    table_.absent[letter] = 0;
    table_.density[letter] = prototype.density;
    for (int i = 0; i < kFeatureCount; ++i) {
      table_.mean[i][letter] = prototype.mean[i];
      for (int j = 0; j <= i; ++j) table_.whitening[i][j][letter] = prototype.whitening(i, j);
    }
  }
}

Classification Classifier::classify(const ShapeFeatures& features) const {
  Verdict verdict;
  Cloned<judge>::call(table_, features.data(), verdict);
  Classification result;
  std::memcpy(result.log_probability.data(), &verdict.log_probability, sizeof verdict.log_probability);
  result.distance = std::sqrt(verdict.nearest);
  result.likelihood = verdict.best;
  if (verdict.best > 0 && result.distance <= distance_max_)
    result.letter = static_cast<std::int8_t>(std::countr_zero(verdict.likeliest));
  return result;
}

}  // namespace slsd
