// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/code/code_array.hpp"
#include "core/decode/prototypes.hpp"

namespace slsd {

/// What a shape is likely to be.
struct Classification {
  std::array<float, kMaxLetters>
      log_probability{};    ///< of each letter, given that it is one of them; natural logarithm
  float distance = 0;       ///< from the nearest prototype, in standard deviations
  std::int8_t letter = -1;  ///< the likeliest, or -1: like none of them
};

/// Compares features with the prototypes.
///
/// The likelihood is Student's t with few degrees of freedom rather than Gaussian: what real surfaces add to the
/// simulated spread must not make one odd symbol outweigh eight good ones.
/// @param distance_max  standard deviations from the nearest prototype beyond which a shape is rejected
/// @thread reentrant
[[nodiscard]] Classification classify(const ShapeFeatures& features, const std::vector<Prototype>& prototypes,
                                      float distance_max);

}  // namespace slsd
