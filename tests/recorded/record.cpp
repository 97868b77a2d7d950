// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cstdio>

#include "tests/recorded/recorded.hpp"

// Writes decoded.txt to standard output.
int main() {
  for (const slsd::FrameGroup& group : slsd::recorded_groups()) {
    const auto lines = slsd::record(group);
    if (!lines) {
      std::fprintf(stderr, "%s: %s\n", group.name().c_str(), to_string(lines.error()).c_str());
      return 1;
    }
    for (const std::string& line : *lines) std::puts(line.c_str());
  }
  return 0;
}
