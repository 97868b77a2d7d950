// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/ticks.hpp"

#include <cmath>
#include <cstdio>

namespace slsd {
namespace {

constexpr int kMostTicks = 1000;

}  // namespace

double tick_step(double span, int most) {
  const double power = std::pow(10.0, std::floor(std::log10(span / most)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power * most >= span) return factor * power;
  }
  return 10.0 * power;
}

std::vector<double> ticks(double low, double high, double step) {
  const double first = std::ceil(low / step - 1e-9), last = std::floor(high / step + 1e-9);
  std::vector<double> values;
  // Counted in whole numbers: far from zero, adding a step may have no effect.
  for (int i = 0; i <= last - first && i < kMostTicks; ++i) values.push_back((first + i) * step);
  return values;
}

std::string tick_label(double value, double step) {
  const int decimals = step >= 1 ? 0 : static_cast<int>(std::ceil(-std::log10(step) - 1e-9));
  char label[32];
  std::snprintf(label, sizeof label, "%.*f", decimals, value == 0 ? 0.0 : value);
  return label;
}

}  // namespace slsd
