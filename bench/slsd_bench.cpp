// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <iostream>
#include <string_view>
#include <vector>

#include <benchmark/benchmark.h>
#include <opencv2/core/utility.hpp>

#include "bench/benchmarks.hpp"
#include "core/decode/decoder.hpp"

namespace {

// Names without how they were timed, so that they stay the same when that changes.
template <class Reporter>
class PlainNames : public Reporter {
 public:
  using Reporter::Reporter;

  void ReportRuns(const std::vector<benchmark::BenchmarkReporter::Run>& runs) override {
    auto renamed = runs;
    for (auto& run : renamed) {
      run.run_name.iterations.clear();
      run.run_name.time_type.clear();
    }
    Reporter::ReportRuns(renamed);
  }
};

slsd::Decoder decoder_for(const slsd::FrameRing& ring) {
  return slsd::Decoder::create(ring.pattern(), ring.calibration(), 0, {}).value();
}

// What is fast because it finds nothing is no measurement.
bool decodes_most(slsd::Decoder& decoder, const slsd::FrameRing& ring) {
  const auto whole = static_cast<std::size_t>(ring.pattern().whole_columns()) * ring.pattern().whole_rows();
  return std::ranges::all_of(ring.frames(), [&](const slsd::Grey8& frame) {
    return decoder.decode(frame.view()).value()->points.size() > whole / 2;
  });
}

void register_all(slsd::FrameRing& ring, slsd::Decoder& decoder) {
  slsd::register_anchor(ring);
  slsd::register_decode(ring, decoder);
  slsd::register_dense(ring);
}

}  // namespace

int main(int argc, char** argv) {
  const bool writes_file = std::any_of(
      argv, argv + argc, [](std::string_view argument) { return argument.starts_with("--benchmark_out="); });
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  cv::setNumThreads(1);
  slsd::FrameRing large(16);
  slsd::FrameRing small(8);
  slsd::Decoder large_decoder = decoder_for(large);
  slsd::Decoder small_decoder = decoder_for(small);
  if (!decodes_most(large_decoder, large) || !decodes_most(small_decoder, small)) {
    std::cerr << "slsd-bench: the decoder finds less than half of the symbols; ./run test tells more\n";
    return 1;
  }
  slsd::register_floor();
  register_all(large, large_decoder);
  register_all(small, small_decoder);
  PlainNames<benchmark::ConsoleReporter> console(benchmark::ConsoleReporter::OO_Tabular);
  PlainNames<benchmark::JSONReporter> file;
  benchmark::RunSpecifiedBenchmarks(&console, writes_file ? &file : nullptr);
  benchmark::Shutdown();
}
