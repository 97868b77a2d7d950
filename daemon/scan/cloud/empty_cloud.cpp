// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/cloud/empty_cloud.hpp"

#include <numeric>
#include <system_error>
#include <utility>

#include "core/calibrate/doubt/frame_doubt.hpp"
#include "drivers/files/grey_image.hpp"

namespace slsd {
namespace {

using std::chrono::steady_clock;

constexpr int kRarely = 10;  // looks take at most a tenth of the time

}  // namespace

std::string EmptyClouds::doubt(const ScanBasis& basis, const FrameSet& set, const std::vector<std::size_t>& cameras,
                               MonotonicTime until) {
  const auto is_ready = [](const std::shared_future<Doubt>& doubt, MonotonicTime time) {
    return doubt.wait_until(time) == std::future_status::ready;
  };
  std::shared_future<Doubt> doubt;
  {
    const std::lock_guard lock(mutex_);
    const auto now = steady_clock::now();
    if (!doubt_.valid() || (is_ready(doubt_, now) && now >= doubt_.get().next)) {
      std::vector<GreyImage> frames;
      for (const Frame& frame : set.frames) frames.push_back(copy_of(frame.image()));
      auto look = [frames = std::move(frames), pattern = basis.pattern, calibration = *basis.calibration, cameras,
                   range = basis.range]() -> Doubt {
        const auto begin = steady_clock::now();
        std::string text;
        for (std::size_t i = 0; i < frames.size() && text.empty(); ++i) {
          std::size_t read = 0;
          text = doubt_by_frame(view(frames[i]), pattern, calibration, cameras[i], range, read);
        }
        const auto end = steady_clock::now();
        return {std::move(text), end + kRarely * (end - begin)};
      };
      try {
        doubt_ = std::async(std::launch::async, std::move(look));
      } catch (const std::system_error&) {  // no thread available: the counters must suffice
        return {};
      }
    }
    doubt = doubt_;
  }
  return is_ready(doubt, until) ? doubt.get().text : std::string();
}

std::string EmptyClouds::explain(const ScanBasis& basis, const FrameSet& set, const std::vector<std::size_t>& cameras,
                                 const ScanResult& result, MonotonicTime until) {
  const auto seen = std::accumulate(result.regions.begin(), result.regions.end(), std::uint64_t{0});
  std::string why = seen >= kSymbolsForDoubt ? doubt(basis, set, cameras, until) : std::string();
  if (!why.empty()) return why;
  return basis.doubts.empty() || seen < kSymbolsForDoubt ? doubt_by_counts(result.regions) : basis.doubts.front();
}

}  // namespace slsd
