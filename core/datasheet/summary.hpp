// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>

namespace slsd {

/// A figure over the places of an artefact.
struct Summary {
  std::size_t places = 0;
  double worst = 0;  ///< of the largest absolute value
  double mean = 0;
  double low = 0, high = 0;  ///< 95 % interval of the mean, from the scatter of the places and the artefact
};

/// @param values        one for each place, at least one
/// @param artefact_mm   expanded uncertainty of the artefact's size, k = 2
/// @thread reentrant
[[nodiscard]] Summary summarise_places(std::span<const double> values, double artefact_mm);

/// The value that a Student's t variable exceeds with 2.5 %. @param degrees_of_freedom  at least 1
/// @thread reentrant
[[nodiscard]] double student_975(std::size_t degrees_of_freedom);

}  // namespace slsd
