// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/latency/measure_latency.hpp"

#include <algorithm>
#include <optional>
#include <random>
#include <vector>

#include "daemon/latency/flash_pixels.hpp"

namespace slsd {
namespace {

using std::chrono::microseconds;
using std::chrono::nanoseconds;

constexpr double kWhole = 0.9;  // lamps and a DLP's flashes let whole ones differ by some percent
constexpr int kLostMax = 5;

bool only_this_frame(ErrorCode code) {
  return code == ErrorCode::kFrameDropped || code == ErrorCode::kFrameTorn || code == ErrorCode::kFrameStale ||
         code == ErrorCode::kFrameLate || code == ErrorCode::kMismatch;
}

/// What one flash told.
struct Flash {
  std::optional<nanoseconds> last_incomplete;
  nanoseconds first_whole{};
};

class LatencyMeter {
 public:
  LatencyMeter(Projector& projector, Camera& camera, const LatencyOptions& options, const Timepiece& time)
      : projector_(projector),
        camera_(camera),
        options_(options),
        time_(time),
        black_(projector.description().width_px, projector.description().height_px, 0),
        white_(projector.description().width_px, projector.description().height_px, 255),
        random_(options.seed) {}

  Result<CameraLatency> measure() {
    auto pixels = look();
    if (!pixels) return tl::unexpected(pixels.error());
    std::vector<Flash> flashes;
    for (int i = 0; i < options_.flashes; ++i) {
      const auto seen = flash(*pixels);
      if (!seen) return tl::unexpected(seen.error());
      flashes.push_back(*seen);
    }
    CameraLatency latency = summarize(flashes);
    latency.camera = camera_.description().name;
    latency.clipped = pixels->clipped();
    return latency;
  }

 private:
  Result<MonotonicTime> show_and_settle(const Grey8& image, nanoseconds more = {}) {
    auto shown = projector_.show(image);
    if (shown) time_.sleep(options_.settle + more);
    return shown;
  }

  /// A frame as far as it matters here.
  struct Seen {
    FlashPixels::Samples samples;
    MonotonicTime exposure_start;
  };

  Result<Seen> capture() {
    for (int lost = 0;; ++lost) {
      const auto frame = camera_.capture(time_.now() + options_.patience);
      if (frame) return Seen{FlashPixels::sample(frame->image()), frame->exposure_start()};
      if (lost == kLostMax || !only_this_frame(frame.error().code)) return tl::unexpected(frame.error());
    }
  }

  Result<FlashPixels::Samples> look_at(const Grey8& image) {
    if (auto shown = show_and_settle(image); !shown) return tl::unexpected(shown.error());
    auto seen = capture();
    if (!seen) return tl::unexpected(seen.error());
    return std::move(seen->samples);
  }

  Result<FlashPixels> look() {
    const auto dark = look_at(black_);
    if (!dark) return tl::unexpected(dark.error());
    const auto dark_again = look_at(black_);
    if (!dark_again) return tl::unexpected(dark_again.error());
    const auto lit = look_at(white_);
    if (!lit) return tl::unexpected(lit.error());
    return FlashPixels::find(*dark, *dark_again, *lit);
  }

  Result<Flash> flash(const FlashPixels& pixels) {
    const nanoseconds pause(std::uniform_int_distribution<std::int64_t>(0, 100'000'000)(random_));
    if (auto shown = show_and_settle(black_, pause); !shown) return tl::unexpected(shown.error());
    const auto shown = projector_.show(white_);
    if (!shown) return tl::unexpected(shown.error());
    Flash flash;
    while (time_.now() < *shown + options_.patience) {
      const auto seen = capture();
      if (!seen) return tl::unexpected(seen.error());
      flash.first_whole = seen->exposure_start - *shown;
      if (pixels.share_of_white(seen->samples) >= kWhole) return flash;
      flash.last_incomplete = flash.first_whole;
    }
    return fail(ErrorCode::kTimeout,
                "a flash was not seen: let nothing move between projector and camera, and measure again");
  }

  static CameraLatency summarize(const std::vector<Flash>& flashes) {
    std::vector<nanoseconds> whole;
    std::optional<nanoseconds> incomplete;
    for (const Flash& flash : flashes) {
      whole.push_back(flash.first_whole);
      if (flash.last_incomplete)
        incomplete = std::max(incomplete.value_or(*flash.last_incomplete), *flash.last_incomplete);
    }
    std::ranges::sort(whole);
    const auto quantile = [&](double share) {
      const auto index = static_cast<std::size_t>(share * static_cast<double>(whole.size() - 1) + 0.5);
      return std::chrono::ceil<microseconds>(whole[index]);
    };
    CameraLatency latency;
    latency.flashes = static_cast<int>(flashes.size());
    latency.median = quantile(0.5);
    latency.p05 = quantile(0.05);
    latency.p95 = quantile(0.95);
    const auto after = incomplete ? std::ranges::upper_bound(whole, *incomplete) : whole.begin();
    latency.latency = std::chrono::ceil<microseconds>(after == whole.end() ? *incomplete : *after);
    return latency;
  }

  Projector& projector_;
  Camera& camera_;
  const LatencyOptions& options_;
  const Timepiece& time_;
  Grey8 black_;
  Grey8 white_;
  std::mt19937 random_;
};

}  // namespace

Result<CameraLatency> measure_latency(Projector& projector, Camera& camera, const LatencyOptions& options,
                                      const Timepiece& time) {
  return LatencyMeter(projector, camera, options, time).measure();
}

}  // namespace slsd
