// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/datasheet/summary.hpp"

#include <array>
#include <cmath>
#include <limits>

namespace slsd {

double student_975(std::size_t degrees_of_freedom) {
  constexpr std::array kFirst{12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228};
  if (degrees_of_freedom <= kFirst.size()) return kFirst[degrees_of_freedom - 1];
  // Cornish-Fisher expansion of the quantile, Abramowitz and Stegun 26.7.5; exact to 0.001 from here on.
  const double z = 1.959964, n = static_cast<double>(degrees_of_freedom), z3 = z * z * z, z5 = z3 * z * z,
               z7 = z5 * z * z;
  return z + (z3 + z) / (4 * n) + (5 * z5 + 16 * z3 + 3 * z) / (96 * n * n) +
         (3 * z7 + 19 * z5 + 17 * z3 - 15 * z) / (384 * n * n * n);
}

Summary summarise_places(std::span<const double> values, double artefact_mm) {
  Summary summary{.places = values.size()};
  for (const double value : values) {
    summary.mean += value / static_cast<double>(values.size());
    if (std::abs(value) > std::abs(summary.worst)) summary.worst = value;
  }
  double half = std::numeric_limits<double>::infinity();
  if (values.size() > 1) {
    double squares = 0;
    for (const double value : values) squares += (value - summary.mean) * (value - summary.mean);
    const auto count = static_cast<double>(values.size());
    half = student_975(values.size() - 1) * std::sqrt(squares / (count - 1) / count);
  }
  half = std::hypot(half, artefact_mm);
  summary.low = summary.mean - half, summary.high = summary.mean + half;
  return summary;
}

}  // namespace slsd
