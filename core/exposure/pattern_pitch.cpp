// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposure/pattern_pitch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "core/geometry/robust.hpp"

namespace slsd {
namespace {

constexpr std::size_t kSymbolsMin = 5;  // of a column, in odd rows as in even ones
constexpr std::size_t kColumnsMin = 20;
constexpr double kSigmaOfMedian = 1.4826;  // of the magnitudes
// The displacement from the cubic has this variance if each of the five has 1: 1 + 2 (4/6)^2 + 2 (1/6)^2.
constexpr double kOfDisplacements = 35 / 18.0;

using Cells = std::map<std::pair<int, int>, double>;  // column and row

std::optional<double> place_at(const Cells& cells, int column, int row) {
  const auto found = cells.find({column, row});
  return found == cells.end() ? std::nullopt : std::optional(found->second);
}

/// Computes how far a symbol lies from the cubic through the two neighbours on either side.
std::optional<double> displacement(const Cells& cells, int column, int row, double x) {
  const auto far_left = place_at(cells, column - 2, row), left = place_at(cells, column - 1, row);
  const auto right = place_at(cells, column + 1, row), far_right = place_at(cells, column + 2, row);
  if (!far_left || !left || !right || !far_right) return std::nullopt;
  return x - (4 * (*left + *right) - *far_left - *far_right) / 6;
}

double variance_of(std::vector<double> values) {
  for (double& value : values) value = std::abs(value);
  return std::pow(kSigmaOfMedian * median_in_place(values), 2);
}

}  // namespace

std::optional<PatternPitch> measure_pitch(std::span<const SymbolPlace> symbols) {
  Cells cells;
  for (const SymbolPlace& symbol : symbols) cells[{symbol.column, symbol.row}] = symbol.x_px;
  std::map<int, std::array<std::vector<double>, 2>> columns;
  std::vector<double> pitches;
  for (const auto& [cell, x] : cells) {
    const auto [column, row] = cell;
    if (const auto left = place_at(cells, column - 1, row)) pitches.push_back(std::abs(x - *left));
    if (const auto away = displacement(cells, column, row, x)) columns[column][row % 2 == 0 ? 0 : 1].push_back(*away);
  }
  std::vector<double> sums, differences;
  for (auto& [column, halves] : columns) {
    if (halves[0].size() < kSymbolsMin || halves[1].size() < kSymbolsMin) continue;
    const double even = median_in_place(halves[0]), odd = median_in_place(halves[1]);
    sums.push_back(even + odd), differences.push_back(even - odd);
  }
  if (sums.size() < kColumnsMin) return std::nullopt;
  const double in_common = (variance_of(sums) - variance_of(differences)) / 4;
  return PatternPitch{median_in_place(pitches), std::sqrt(std::max(0.0, in_common) / kOfDisplacements)};
}

}  // namespace slsd
