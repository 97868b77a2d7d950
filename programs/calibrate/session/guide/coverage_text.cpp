// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/session/guide/coverage_text.hpp"

#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/calibrate/judge/coverage.hpp"

namespace slsd {
namespace {

constexpr int kMany = 20;  // points in a cell
constexpr int kWidth = 2 * kCoverageColumns + 2;

char letter(int count) {
  return count == 0 ? '.' : count < kMany ? 'o' : '#';
}

std::string row_text(const Coverage& coverage, int row) {
  std::string text;
  for (int column = 0; column < kCoverageColumns; ++column) {
    text += letter(coverage.counts[static_cast<std::size_t>(row * kCoverageColumns + column)]);
    text += ' ';
  }
  return text;
}

}  // namespace

std::string coverage_text(const Observations& observations) {
  std::vector<std::pair<std::string, Coverage>> devices;
  for (std::size_t i = 0; i < observations.cameras.size(); ++i) {
    devices.emplace_back("camera " + observations.cameras[i].name, camera_coverage(observations, i));
  }
  devices.emplace_back("projector", projector_coverage(observations));
  std::string text;
  const auto add_line = [&](auto&& part) {
    std::string line;
    for (const auto& device : devices) line += fmt::format("{:<{}}", part(device), kWidth);
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  };
  add_line([](const auto& device) { return device.first.substr(0, kWidth - 1); });
  for (int row = 0; row < kCoverageRows; ++row) {
    add_line([row](const auto& device) { return row_text(device.second, row); });
  }
  return text;
}

}  // namespace slsd
