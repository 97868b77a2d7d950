// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/code/code_array.hpp"
#include "core/decode/symbols/prototypes.hpp"

namespace slsd {

/// Distance from a letter's prototype, in standard deviations, beyond which a shape is split: its centre is then
/// unreliable.
inline constexpr float kSplitDistance = 6;

/// Probabilities of the letters that a shape may show.
struct Classification {
  std::array<float, kMaxLetters>
      log_probability{};    ///< natural logarithm for each letter, given that the shape is one; 0 beyond the last
  float distance = 0;       ///< distance from the nearest prototype, in standard deviations
  float likelihood = 0;     ///< density of the features as the likeliest letter, up to a common factor
  std::int8_t letter = -1;  ///< the likeliest, or -1: like no letter

  /// Makes the classification of a shape whose letter is known, as if at a given distance.
  [[nodiscard]] static Classification of_letter(int letter, int letters, float distance);
  /// Tells whether the shape is whole, or nearly: then its letter counts as evidence.
  [[nodiscard]] bool is_well_seen() const {
    constexpr float kWellSeen = 3;  // standard deviations
    return letter >= 0 && distance < kWellSeen;
  }
  [[nodiscard]] bool is_split() const { return distance >= kSplitDistance; }
  /// The probability of a letter, 0 to 1, if only letters can be there. It excludes the assumed doubt.
  /// @param even  probability of one letter if all are equally likely
  [[nodiscard]] float share_of(int of_letter, float even) const;
};

/// Compares features with prototypes, those of eight shapes at once.
///
/// The likelihood is Student's t with few degrees of freedom rather than Gaussian. Real surfaces add spread that the
/// simulation lacks, and one odd symbol must not outweigh eight good ones.
/// @thread reentrant
class Classifier {
 public:
  /// @param prototypes    one for each letter, at most kMaxLetters
  /// @param distance_max  standard deviations from the nearest prototype beyond which a shape is rejected
  Classifier(const std::vector<Prototype>& prototypes, float distance_max);

  [[nodiscard]] Classification classify(const ShapeFeatures& features) const;
  /// @param to  becomes the classifications of the first shapes, as many as it holds
  void classify(const EightShapes& shapes, std::span<Classification> to) const;

  /// Distances of eight shapes from each letter's prototype, standard deviations squared.
  struct EightDistances {
    Lanes of[kMaxLetters];
  };
  void find_squared_distances(const EightShapes& shapes, EightDistances& squared) const;

  /// A prototype's numbers.
  struct Letter {
    float mean[kFeatureCount], whitening[kFeatureCount][kFeatureCount];  ///< lower triangular
    float density;
  };

 private:
  std::vector<Letter> letters_;
  float share_;  // share of one letter if all are equally likely
  float distance_max_;
};

}  // namespace slsd
