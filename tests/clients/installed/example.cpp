// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <slsd/scanner.hpp>

#include <cstdio>

int main() {
  try {
    slsd::client::Scanner scanner;
    const slsd::client::Cloud cloud = scanner.scan();
    double sum = 0;
    for (const slsd::client::Point point : cloud) sum += point.z;
    std::printf("%zu points, %.3f mm away\n", cloud.size(), sum / static_cast<double>(cloud.size()));

    int clouds = 0;
    slsd::client::Stream stream = scanner.stream();
    for (const slsd::client::Cloud& each : stream) {
      if (each.size() != cloud.size() || ++clouds == 3) break;
    }
    std::printf("%d clouds of the same size\n", clouds);
  } catch (const slsd::client::ScannerError& error) {
    std::fprintf(stderr, "%s: %s\n", error.name().c_str(), error.what());
    return 1;
  }
}
