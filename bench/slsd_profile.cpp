// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <linux/perf_event.h>
#include <sys/ioctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <ctime>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <opencv2/core/utility.hpp>

#include "bench/opencv_anchor.hpp"
#include "core/calibration_file/calibration_file.hpp"
#include "core/code/pattern.hpp"
#include "core/decode/decoder.hpp"
#include "core/dense/dense_mapper.hpp"
#include "core/exposure/light_levels.hpp"
#include "drivers/files/read_image.hpp"
#include "drivers/system/crew.hpp"
#include "tests/corpus/read_with.hpp"

namespace slsd {
namespace {

constexpr int kCacheLineBytes = 64;

/// A hardware counter of this thread. Machines without one, many virtual ones among them, give no value.
class HardwareCounter {
 public:
  explicit HardwareCounter(std::uint64_t event) {
    perf_event_attr attributes{};
    attributes.type = PERF_TYPE_HARDWARE;
    attributes.size = sizeof attributes;
    attributes.config = event;
    attributes.exclude_kernel = 1;
    file_ = static_cast<int>(syscall(SYS_perf_event_open, &attributes, 0, -1, -1, 0));
  }
  HardwareCounter(const HardwareCounter&) = delete;
  HardwareCounter& operator=(const HardwareCounter&) = delete;
  ~HardwareCounter() {
    if (file_ >= 0) close(file_);
  }
  [[nodiscard]] std::optional<double> now() const {
    std::uint64_t value = 0;
    if (file_ < 0 || read(file_, &value, sizeof value) != sizeof value) return std::nullopt;
    return static_cast<double>(value);
  }

 private:
  int file_;
};

/// The time of this thread's processor or, if other threads help, of the clock on the wall.
double ms_of(bool alone) {
  timespec now{};
  clock_gettime(alone ? CLOCK_THREAD_CPUTIME_ID : CLOCK_MONOTONIC, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

/// Costs of a stage.
struct Cost {
  double ms = 0;
  std::optional<double> instructions, cache_misses;
};

constexpr std::size_t kStages = kStageCount + kDenseStageCount;

/// The costs of a frame's stages, one after the other: those of the decoder, then those of the dense cloud.
class StageMeter final : public StageObserver, public DenseObserver {
 public:
  explicit StageMeter(bool alone) : alone_(alone) {}
  void start() { costs = {}, last_ = read(); }
  void stage_done(Stage stage) override { done(static_cast<std::size_t>(stage)); }
  void stage_done(DenseStage stage) override { done(kStageCount + static_cast<std::size_t>(stage)); }

  std::array<Cost, kStages> costs{};

 private:
  void done(std::size_t stage) {
    const Cost now = read();
    costs[stage].ms = now.ms - last_.ms;
    if (now.instructions) costs[stage].instructions = *now.instructions - *last_.instructions;
    if (now.cache_misses) costs[stage].cache_misses = *now.cache_misses - *last_.cache_misses;
    last_ = read();
  }
  [[nodiscard]] Cost read() const { return {ms_of(alone_), instructions_.now(), cache_misses_.now()}; }
  bool alone_;
  HardwareCounter instructions_{PERF_COUNT_HW_INSTRUCTIONS}, cache_misses_{PERF_COUNT_HW_CACHE_MISSES};
  Cost last_;
};

struct Request {
  std::string frame, pattern, calibration;
  int stride_px = DenseOptions{}.stride_px, repeat = 15, cores = 1;
  double part = 1;  ///< share of the frame to measure, in its middle
  bool without_anchor = false;
};

std::string_view name_of(std::size_t stage) {
  return stage < kStageCount ? to_string(static_cast<Stage>(stage))
                             : to_string(static_cast<DenseStage>(stage - kStageCount));
}

template <class Number>
Number median(std::vector<Number> values) {
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
  return values[values.size() / 2];
}

void print_row(std::string_view name, double least_ms, double median_ms, double anchor_ms, const Cost& last) {
  const auto millions = [](const std::optional<double>& count, double each) {
    return count ? fmt::format("{:.1f}", *count * each * 1e-6) : std::string("-");
  };
  std::printf("%-14.*s %9.2f %9.2f %9.2f %14s %10s\n", static_cast<int>(name.size()), name.data(), least_ms, median_ms,
              least_ms / anchor_ms, millions(last.instructions, 1).c_str(),
              millions(last.cache_misses, kCacheLineBytes).c_str());
}

/// The middle of a frame.
PixelRectangle middle_of(const Lens& lens, double share) {
  const auto from = [&](int px) { return static_cast<int>((1 - std::sqrt(share)) / 2 * px); };
  return {from(lens.width_px), from(lens.height_px), lens.width_px - from(lens.width_px),
          lens.height_px - from(lens.height_px)};
}

/// Compares the points of a part with those of the whole frame there.
void print_differences(const DenseMap& part, const DenseMap& whole) {
  std::size_t both = 0, only_part = 0, only_whole = 0;
  std::vector<double> sigmas{0};
  const PixelRectangle& pixels = part.part;
  for (int y = pixels.top; y < pixels.bottom; ++y) {
    for (int x = pixels.left; x < pixels.right; ++x) {
      const std::size_t at = static_cast<std::size_t>(y) * whole.width + x;
      only_part += part.measured(at) && !whole.measured(at), only_whole += whole.measured(at) && !part.measured(at);
      if (!part.measured(at) || !whole.measured(at)) continue;
      ++both;
      sigmas.push_back(std::abs(static_cast<double>((part.depth_mm[at] - whole.depth_mm[at]) / whole.sigma_mm[at])));
    }
  }
  const auto twentieth = sigmas.begin() + static_cast<std::ptrdiff_t>(sigmas.size() * 19 / 20);
  std::ranges::nth_element(sigmas, twentieth);
  std::printf(
      "%zu points as in the whole frame, %zu not there, %zu only there; 95 %% of the depths differ by %.3f sigma at "
      "most\n",
      both, only_part, only_whole, *twentieth);
}

Result<> profile(const Request& request) {
  const auto pattern = read_with(read_pattern, request.pattern);
  if (!pattern) return tl::unexpected(pattern.error());
  const auto calibration = read_with(read_calibration, request.calibration);
  if (!calibration) return tl::unexpected(calibration.error());
  const auto frame = read_image(request.frame);
  if (!frame) return tl::unexpected(frame.error());
  DecodeOptions options;
  options.dense.stride_px = request.stride_px;
  auto decoder = Decoder::create(*pattern, *calibration, 0, options);
  if (!decoder) return tl::unexpected(decoder.error());
  DenseMapper mapper(*pattern, *calibration, 0, options);
  if (request.part < 1) mapper.set_part(middle_of(calibration->cameras[0].lens, request.part));
  decoder->set_part(mapper.part_of_symbols());
  const GreyView pixels = view(*frame);
  const double full = guess_full_level(pixels);
  OpencvAnchor anchor;
  Crew executor(request.cores - 1);
  StageMeter meter(request.cores == 1);
  std::vector<double> anchors, decodes, denses, wholes;
  std::array<std::vector<double>, kStages> stages;
  std::uint32_t points = 0;
  for (int i = 0; i <= request.repeat; ++i) {
    const double before = ms_of(true);
    if (const auto* grey = std::get_if<ImageView<std::uint8_t>>(&pixels); grey != nullptr && !request.without_anchor)
      (void)anchor.run(*grey);
    const double after = ms_of(true);
    meter.start();
    if (const auto decoded = decoder->decode(pixels, full, &meter, &executor); !decoded)
      return tl::unexpected(decoded.error());
    points = mapper.measure(pixels, full, decoder->symbols(executor), executor, &meter).count(DensePixel::kMeasured);
    if (i == 0) continue;  // fills buffers
    anchors.push_back(after - before);
    double decode = 0, dense = 0;
    for (std::size_t stage = 0; stage < kStages; ++stage) {
      stages[stage].push_back(meter.costs[stage].ms);
      (stage < kStageCount ? decode : dense) += meter.costs[stage].ms;
    }
    decodes.push_back(decode), denses.push_back(dense), wholes.push_back(decode + dense);
  }
  const double anchor_ms = std::ranges::min(anchors);
  std::printf("%-14s %9s %9s %9s %14s %10s\n", "stage", "least ms", "median", "/ anchor", "M instructions",
              "MB missed");
  Cost sum;
  for (std::size_t stage = 0; stage < stages.size(); ++stage) {
    const Cost& cost = meter.costs[stage];
    if (stage == static_cast<std::size_t>(Stage::kAlign)) continue;  // not by default
    print_row(name_of(stage), std::ranges::min(stages[stage]), median(stages[stage]), anchor_ms, cost);
    if (cost.instructions) sum.instructions = sum.instructions.value_or(0) + *cost.instructions;
    if (cost.cache_misses) sum.cache_misses = sum.cache_misses.value_or(0) + *cost.cache_misses;
  }
  print_row("decode", std::ranges::min(decodes), median(decodes), anchor_ms, {});
  print_row("dense", std::ranges::min(denses), median(denses), anchor_ms, {});
  print_row("whole", std::ranges::min(wholes), median(wholes), anchor_ms, sum);
  print_row("anchor", anchor_ms, median(anchors), anchor_ms, {});
  const std::string cores = request.cores == 1 ? "one core" : fmt::format("{} cores", request.cores);
  std::printf("%u points, stride %d px, %s; the least and the median of %d frames\n", points,
              DenseMapper::stride_px(calibration->cameras[0].lens, options.dense), cores.c_str(), request.repeat);
  if (request.part < 1) {
    DenseMapper of_whole(*pattern, *calibration, 0, options);
    const DenseMap part = mapper.measure(pixels, full, decoder->symbols(), executor);
    decoder->set_part(std::nullopt);
    if (const auto decoded = decoder->decode(pixels, full); !decoded) return tl::unexpected(decoded.error());
    print_differences(part, of_whole.measure(pixels, full, decoder->symbols(), executor));
  }
  if (!sum.instructions) std::puts("this machine counts no instructions and no cache misses");
  return {};
}

}  // namespace
}  // namespace slsd

int main(int argc, char** argv) {
  using namespace slsd;
  cv::setNumThreads(1);  // the times are those of one core
  Request request;
  CLI::App app("Prints what each stage of a dense cloud costs, for a recorded frame.", "slsd-profile");
  app.add_option("frame", request.frame, "Image file of one camera")->required();
  app.add_option("--pattern", request.pattern, "Pattern file (default: pattern.toml beside the frame)");
  app.add_option("--calibration", request.calibration, "Calibration (default: calibration.yml beside the frame)");
  app.add_option("--stride", request.stride_px, "dense_stride_px")->check(CLI::Range(1, 16))->capture_default_str();
  app.add_option("--repeat", request.repeat, "Number of frames")->check(CLI::Range(1, 100000))->capture_default_str();
  app.add_option("--part", request.part, "Share of the frame to measure, in its middle")->check(CLI::Range(0.001, 1.0));
  app.add_option("--cores", request.cores, "Threads that share each stage, as in the service; the anchor has one")
      ->check(CLI::Range(1, 16))
      ->capture_default_str();
  app.add_flag("--no-anchor", request.without_anchor, "Do not measure the anchor; for samplers");
  CLI11_PARSE(app, argc, argv);
  const auto beside = std::filesystem::path(request.frame).parent_path();
  if (request.pattern.empty()) request.pattern = beside / "pattern.toml";
  if (request.calibration.empty()) request.calibration = beside / "calibration.yml";
  if (const auto done = profile(request); !done) {
    std::fprintf(stderr, "slsd-profile: %s\n", to_string(done.error()).c_str());
    return 1;
  }
  return 0;
}
