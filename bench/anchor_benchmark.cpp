// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <string>

#include <benchmark/benchmark.h>
#include <opencv2/core/utility.hpp>
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
  const auto run = [&ring](benchmark::State& state, int threads) {
    cv::setNumThreads(threads);
    cv::Mat mask, labels, statistics, centroids;
    int regions = 0;
    for (auto _ : state) {
      cv::adaptiveThreshold(as_mat(ring.next()), mask, 255, cv::ADAPTIVE_THRESH_MEAN_C, cv::THRESH_BINARY, kBlockPx,
                            kOffset);
      regions = cv::connectedComponentsWithStats(mask, labels, statistics, centroids);
    }
    state.counters["regions"] = regions - 1;
    cv::setNumThreads(1);
  };
  const std::string size = "1600x1200_" + std::to_string(ring.pattern().options.symbol_size_px) + "px";
  benchmark::RegisterBenchmark(("opencv_anchor/" + size).c_str(), [run](benchmark::State& state) {
    run(state, 1);
  })->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark(("opencv_anchor/all_cores_" + size).c_str(),
                               [run](benchmark::State& state) {
                                 constexpr int kAsManyAsThereAre = -1;
                                 run(state, kAsManyAsThereAre);
                               })
      ->Unit(benchmark::kMillisecond)
      ->UseRealTime();
}

}  // namespace slsd
