// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/adversary/margin_table.hpp"

#include <algorithm>
#include <cstdio>
#include <string>

#include "core/decode/inference/margin.hpp"

namespace slsd::adversary {

void MarginTable::add(const Decoding& decoding, const std::vector<CloudPoint>& wrong_points) {
  for (const RegionSeen& region : decoding.regions) {
    if (region.status != RegionStatus::kDecoded) continue;
    Row& row = by_nat_[static_cast<std::size_t>(std::clamp(static_cast<int>(region.margin_nats), 0, kNats - 1))];
    ++row.points, row.expected += wrong_share(region.margin_nats);
    row.wrong += std::ranges::any_of(wrong_points, [&](const CloudPoint& point) {
      return point.row == region.row && point.column == region.column;
    });
  }
}

void MarginTable::print() const {
  std::puts("\n| margin, nats | points | wrong | expected |\n|---|---|---|---|");
  for (int nat = kNats - 1; nat >= 0; --nat) {
    const Row& row = by_nat_[static_cast<std::size_t>(nat)];
    if (row.points == 0) continue;
    const std::string to = nat == kNats - 1 ? "on" : "to " + std::to_string(nat + 1);
    std::printf("| %d %s | %d | %d | %.2f |\n", nat, to.c_str(), row.points, row.wrong, row.expected);
  }
}

}  // namespace slsd::adversary
