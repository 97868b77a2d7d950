// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

namespace slsd {

/// A table in Markdown, columns padded so that it reads well as text too.
class Table {
 public:
  explicit Table(std::vector<std::string> headings) : rows_{std::move(headings)} {}

  void add(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }
  [[nodiscard]] std::string markdown() const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

/// A number with so many decimals.
[[nodiscard]] std::string decimals(double value, int count);

/// "5, 7, 22".
[[nodiscard]] std::string listed(const std::vector<int>& numbers);

}  // namespace slsd
