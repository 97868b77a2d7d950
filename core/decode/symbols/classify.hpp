// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/code/code_array.hpp"
#include "core/decode/symbols/prototypes.hpp"

namespace slsd {

/// How far from a letter's prototype, in standard deviations, a shape is torn: its centre lies anywhere.
inline constexpr float kTornDistance = 6;

/// What a shape is likely to be.
struct Classification {
  std::array<float, kMaxLetters>
      log_probability{};    ///< of each letter, given that it is one of them; natural logarithm
  float distance = 0;       ///< from the nearest prototype, in standard deviations
  float likelihood = 0;     ///< of the features if it is the likeliest letter, up to a factor common to all classifiers
  std::int8_t letter = -1;  ///< the likeliest, or -1: like none of them

  /// Whole, or nearly: what it shows counts.
  [[nodiscard]] bool is_well_seen() const {
    constexpr float kWellSeen = 3;  // standard deviations
    return letter >= 0 && distance < kWellSeen;
  }
  [[nodiscard]] bool is_torn() const { return distance >= kTornDistance; }
};

/// Compares features with prototypes, all letters at once.
///
/// The likelihood is Student's t with few degrees of freedom rather than Gaussian: what real surfaces add to the
/// simulated spread must not make one odd symbol outweigh eight good ones.
/// @thread reentrant
class Classifier {
 public:
  /// @param prototypes    one to a letter, kMaxLetters at most
  /// @param distance_max  standard deviations from the nearest prototype beyond which a shape is rejected
  Classifier(const std::vector<Prototype>& prototypes, float distance_max);

  [[nodiscard]] Classification classify(const ShapeFeatures& features) const;

  /// The prototypes' numbers, each with a place for every letter.
  struct Table {
    alignas(32) float mean[kFeatureCount][kMaxLetters];
    alignas(32) float whitening[kFeatureCount][kFeatureCount][kMaxLetters];  ///< lower triangular
    alignas(32) float density[kMaxLetters];
    alignas(32) float absent[kMaxLetters];  ///< squared distance that a place without a letter has more
    float share;                            ///< of one letter among all
  };

 private:
  Table table_;
  float distance_max_;
};

}  // namespace slsd
