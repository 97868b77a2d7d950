// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "docs/tables/table.hpp"

#include <algorithm>
#include <cstdio>

namespace slsd {
namespace {

std::string line_of(const std::vector<std::string>& cells, const std::vector<std::size_t>& widths) {
  std::string line = "|";
  for (std::size_t i = 0; i < cells.size(); ++i)
    line += " " + cells[i] + std::string(widths[i] - cells[i].size(), ' ') + " |";
  return line + "\n";
}

std::string rule_of(const std::vector<std::size_t>& widths) {
  std::string line = "|";
  for (const std::size_t width : widths) line += std::string(width + 2, '-') + "|";
  return line + "\n";
}

}  // namespace

std::string Table::markdown() const {
  std::vector<std::size_t> widths(rows_.front().size(), 1);
  for (const auto& row : rows_)
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  std::string text = line_of(rows_.front(), widths) + rule_of(widths);
  for (std::size_t row = 1; row < rows_.size(); ++row) text += line_of(rows_[row], widths);
  return text + "\n";
}

std::string decimals(double value, int count) {
  char text[64];
  // Minus zero would come and go between compilers.
  std::snprintf(text, sizeof text, "%.*f", count, value);
  const std::string written = text;
  return written.find_first_not_of("-0.") == std::string::npos && written[0] == '-' ? written.substr(1) : written;
}

std::string listed(const std::vector<int>& numbers) {
  std::string text;
  for (const int number : numbers) text += (text.empty() ? "" : ", ") + std::to_string(number);
  return text;
}

}  // namespace slsd
