// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <string>

#include <benchmark/benchmark.h>
#include <opencv2/core/utility.hpp>

#include "bench/benchmarks.hpp"
#include "bench/opencv_anchor.hpp"

namespace slsd {

void register_anchor(FrameRing& ring) {
  const auto run = [&ring](benchmark::State& state, int threads) {
    cv::setNumThreads(threads);
    OpencvAnchor anchor;
    int regions = 0;
    for (auto _ : state) regions = anchor.run(ring.next().view());
    state.counters["regions"] = regions;
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
