// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <string>

#include <benchmark/benchmark.h>
#include <opencv2/imgproc.hpp>

#include "bench/benchmarks.hpp"

namespace slsd {
namespace {

constexpr int kBlockPx = 41;
// A pixel is lit that exceeds the mean around it by this: without it the noise of dark places would be regions too, and
// the anchor slower.
constexpr double kOffset = -10;

cv::Mat1b as_mat(const Grey8& image) {
  return {image.height(), image.width(), const_cast<std::uint8_t*>(image.data())};
}

}  // namespace

void register_anchor(FrameRing& ring) {
  const std::string name = "opencv_anchor/1600x1200_" + std::to_string(ring.pattern().options.symbol_size_px) + "px";
  benchmark::RegisterBenchmark(name.c_str(), [&ring](benchmark::State& state) {
    cv::Mat mask, labels, statistics, centroids;
    int regions = 0;
    for (auto _ : state) {
      cv::adaptiveThreshold(as_mat(ring.next()), mask, 255, cv::ADAPTIVE_THRESH_MEAN_C, cv::THRESH_BINARY, kBlockPx,
                            kOffset);
      regions = cv::connectedComponentsWithStats(mask, labels, statistics, centroids);
    }
    state.counters["regions"] = regions - 1;
  })->Unit(benchmark::kMillisecond);
}

}  // namespace slsd
