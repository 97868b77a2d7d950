// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <ctime>

#include <array>
#include <string>

#include <benchmark/benchmark.h>

#include "bench/benchmarks.hpp"
#include "core/decode/decoder.hpp"
#include "drivers/system/crew.hpp"

namespace slsd {
namespace {

// The processor's time of this thread: on a busy machine the wall clock measures the others.
double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

class StageTimer : public StageObserver {
 public:
  void start() {
    spent_.fill(0);
    last_ = thread_seconds();
  }
  void stage_done(Stage stage) override {
    const double now = thread_seconds();
    spent_[static_cast<std::size_t>(stage)] += now - last_;
    last_ = now;
  }
  [[nodiscard]] double seconds(Stage stage) const { return spent_[static_cast<std::size_t>(stage)]; }

 private:
  double last_ = 0;
  std::array<double, kStageCount> spent_{};
};

void decode(benchmark::State& state, FrameRing& ring, Decoder& decoder, Executor* executor) {
  std::size_t points = 0;
  for (auto _ : state)
    points = decoder.decode(ring.next().view(), std::nullopt, nullptr, executor).value()->points.size();
  state.counters["points"] = static_cast<double>(points);
}

void stage(benchmark::State& state, FrameRing& ring, Decoder& decoder, Stage stage) {
  StageTimer timer;
  for (auto _ : state) {
    timer.start();
    benchmark::DoNotOptimize(decoder.decode(ring.next().view(), 255, &timer));
    state.SetIterationTime(timer.seconds(stage));
  }
}

}  // namespace

void register_decode(FrameRing& ring, Decoder& decoder) {
  const std::string size = std::to_string(ring.pattern().options.symbol_size_px) + "px";
  benchmark::RegisterBenchmark(("decode/1600x1200_" + size).c_str(), [&](benchmark::State& state) {
    decode(state, ring, decoder, nullptr);
  })->Unit(benchmark::kMillisecond);
  // The wall clock: on a busy machine it measures the others too.
  benchmark::RegisterBenchmark(("decode/all_cores_1600x1200_" + size).c_str(),
                               [&](benchmark::State& state) {
                                 Crew crew(Crew::helpers_here());
                                 decode(state, ring, decoder, &crew);
                                 state.counters["workers"] = crew.workers();
                               })
      ->Unit(benchmark::kMillisecond)
      ->UseRealTime();
  for (int i = 0; i < kStageCount; ++i) {
    const auto which = static_cast<Stage>(i);
    const std::string name = "stage/" + std::string(to_string(which)) + "_" + size;
    benchmark::RegisterBenchmark(name.c_str(),
                                 [&, which](benchmark::State& state) { stage(state, ring, decoder, which); })
        ->Unit(benchmark::kMillisecond)
        ->UseManualTime()
        ->Iterations(kRingFrames);
  }
}

}  // namespace slsd
