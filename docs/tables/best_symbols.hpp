// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

namespace slsd {

/// Measurements of the simulated camera on all 25 symbols at a size, over blurs of 0.8, 1.1 and 1.4 camera px.
struct AlphabetSurvey {
  std::map<std::pair<int, int>, double> distances;  ///< of each pair, at the blur that brings them closest
  std::map<int, double> losses;                     ///< of each symbol, the mean over the blurs

  [[nodiscard]] double distance(int a, int b) const { return distances.at(std::minmax(a, b)); }
};

struct RankedSymbols {
  std::vector<int> symbols;
  double smallest_distance;  ///< standard deviations
  double mean_loss;          ///< 0 to 1

  /// The merit that ranks sets: the distance of the closest pair less one for each per cent of views in which a symbol
  /// is lost.
  [[nodiscard]] double merit() const { return smallest_distance - 100 * mean_loss; }
};

[[nodiscard]] AlphabetSurvey survey_alphabet(int symbol_size_px, int spacing_px);

[[nodiscard]] RankedSymbols rank(const AlphabetSurvey& survey, std::vector<int> symbols);

/// Finds the sets of `count` symbols with the most merit, best first.
[[nodiscard]] std::vector<RankedSymbols> best_symbols(const AlphabetSurvey& survey, int count, std::size_t how_many);

}  // namespace slsd
