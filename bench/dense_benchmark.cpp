// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <ctime>

#include <array>
#include <memory>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/benchmarks.hpp"
#include "core/dense/dense_mapper.hpp"
#include "drivers/system/crew.hpp"

namespace slsd {
namespace {

double seconds_of(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// The time of this thread in each stage.
class StageTimer final : public DenseObserver {
 public:
  void start() { last_ = seconds_of(CLOCK_THREAD_CPUTIME_ID); }
  void stage_done(DenseStage stage) override {
    const double now = seconds_of(CLOCK_THREAD_CPUTIME_ID);
    spent_[static_cast<std::size_t>(stage)] = now - last_;
    last_ = now;
  }
  [[nodiscard]] double seconds(DenseStage stage) const { return spent_[static_cast<std::size_t>(stage)]; }

 private:
  double last_ = 0;
  std::array<double, kDenseStageCount> spent_{};
};

/// One frame of the ring, decoded: the others differ in distance and tilt alone.
struct Bench {
  FrameRing& ring;
  DecodeOptions options;
  Decoder decoder;
  DenseMapper mapper;
  const Grey8& frame;

  Bench(FrameRing& of_ring, const DecodeOptions& with)
      : ring(of_ring),
        options(with),
        decoder(Decoder::create(ring.pattern(), ring.calibration(), 0, with).value()),
        mapper(ring.pattern(), ring.calibration(), 0, with),
        frame(ring.frames().front()) {
    (void)decoder.decode(frame.view());
  }
  std::uint32_t measure(Executor& executor, DenseObserver* observer = nullptr) {
    return mapper.measure(frame.view(), 255, decoder.symbols(), executor, observer).count(DensePixel::kMeasured);
  }
};

/// Measures the stream of a scene that stands still: every frame but the first two goes on from the one before.
void measure_stream(Bench& bench, Executor& executor, benchmark::State& state) {
  const auto next = [&] {
    return bench.mapper.measure_next(bench.frame.view(), 255, bench.decoder.symbols(), executor)
        .count(DensePixel::kMeasured);
  };
  for (int i = 0; i < 3; ++i) (void)next();
  for (auto _ : state) benchmark::DoNotOptimize(next());
  state.counters["followed_nodes"] = static_cast<double>(bench.mapper.followed_nodes());
}

}  // namespace

void register_dense(FrameRing& ring) {
  const std::string size = std::to_string(ring.pattern().options.symbol_size_px) + "px";
  for (const int stride : {4, 8}) {
    const auto made = [&ring, stride] {
      DecodeOptions options;
      options.dense.stride_px = stride;
      return std::make_shared<Bench>(ring, options);
    };
    const std::string of = "_stride_" + std::to_string(stride) + "_" + size;
    benchmark::RegisterBenchmark(("dense/one_core" + of).c_str(), [made](benchmark::State& state) {
      const auto bench = made();
      SerialExecutor executor;
      std::uint32_t points = bench->measure(executor);
      for (auto _ : state) points = bench->measure(executor);
      state.counters["points"] = points;
    })->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark(("dense/still_one_core" + of).c_str(), [made](benchmark::State& state) {
      SerialExecutor executor;
      measure_stream(*made(), executor, state);
    })->Unit(benchmark::kMillisecond);
    // The wall clock: on a busy machine it measures the others too.
    benchmark::RegisterBenchmark(("dense/all_cores" + of).c_str(),
                                 [made](benchmark::State& state) {
                                   const auto bench = made();
                                   Crew crew(Crew::helpers_here());
                                   (void)bench->measure(crew);
                                   for (auto _ : state) benchmark::DoNotOptimize(bench->measure(crew));
                                   state.counters["workers"] = crew.workers();
                                 })
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
    for (int i = 0; i < kDenseStageCount; ++i) {
      const auto stage = static_cast<DenseStage>(i);
      benchmark::RegisterBenchmark(("stage/dense_" + std::string(to_string(stage)) + of).c_str(),
                                   [made, stage](benchmark::State& state) {
                                     const auto bench = made();
                                     SerialExecutor executor;
                                     (void)bench->measure(executor);
                                     StageTimer timer;
                                     for (auto _ : state) {
                                       timer.start();
                                       benchmark::DoNotOptimize(bench->measure(executor, &timer));
                                       state.SetIterationTime(timer.seconds(stage));
                                     }
                                   })
          ->Unit(benchmark::kMillisecond)
          ->UseManualTime()
          ->Iterations(3);
    }
  }
}

}  // namespace slsd
