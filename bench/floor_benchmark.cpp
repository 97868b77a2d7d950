// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cstdint>
#include <memory>
#include <numeric>
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/benchmarks.hpp"

namespace slsd {
namespace {

constexpr std::size_t kFrameBytes = 1600 * 1200;
constexpr std::size_t kFrames = 128;  // 246 MB: more than any processor's last cache

std::uint64_t sum_of(const std::uint64_t* words, std::size_t count) {
  return std::accumulate(words, words + count, std::uint64_t{0});
}

}  // namespace

void register_floor() {
  benchmark::RegisterBenchmark("floor/1600x1200", [](benchmark::State& state) {
    const std::vector<std::uint64_t> memory(kFrames * kFrameBytes / sizeof(std::uint64_t), 1);
    constexpr std::size_t kWords = kFrameBytes / sizeof(std::uint64_t);
    std::size_t frame = 0;
    for (auto _ : state) {
      benchmark::DoNotOptimize(sum_of(memory.data() + frame++ % kFrames * kWords, kWords));
    }
  })->Unit(benchmark::kMillisecond);
}

}  // namespace slsd
