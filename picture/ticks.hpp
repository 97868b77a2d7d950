// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

namespace slsd {

/// The smallest step of 1, 2 or 5 times a power of ten with at most `most` steps in the span.
/// @param span  above zero
[[nodiscard]] double tick_step(double span, int most);

/// The multiples of the step within [low, high].
[[nodiscard]] std::vector<double> ticks(double low, double high, double step);

/// The number with as many decimals as the step needs.
[[nodiscard]] std::string tick_label(double value, double step);

}  // namespace slsd
