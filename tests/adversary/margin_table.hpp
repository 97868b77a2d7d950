// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <vector>

#include "core/cloud/cloud.hpp"
#include "core/decode/decoding.hpp"

namespace slsd::adversary {

/// Counts points, and wrong ones among them, by the margin of their cells.
class MarginTable {
 public:
  /// @param wrong_points  those of the decoding's points that are wrong
  void add(const Decoding& decoding, const std::vector<CloudPoint>& wrong_points);
  /// Prints a row for each nat: the points, how many are wrong, and how many wrong_share() expects.
  void print() const;

  static constexpr int kNats = 15;  ///< the last holds all with more
  struct Row {
    int points = 0, wrong = 0;
    double expected = 0;
  };
  [[nodiscard]] const Row& at(int nat) const { return by_nat_[static_cast<std::size_t>(nat)]; }

 private:
  std::array<Row, kNats> by_nat_{};
};

}  // namespace slsd::adversary
