// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/latency/measure_latency.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <random>
#include <variant>
#include <vector>

#include "core/image.hpp"

namespace slsd {
namespace {

using std::chrono::microseconds;
using std::chrono::nanoseconds;

constexpr double kWhole = 0.9;  // lamps and a DLP's flashes make complete frames differ by some percent
constexpr int kLostMax = 5;
constexpr auto kShowTime = std::chrono::seconds(10);

constexpr int kSamplesAcross = 200;
constexpr double kBrightest = 0.99;
constexpr double kChosen = 0.5;    // share of the flash's own brightest
constexpr double kAboveNoise = 4;  // multiple of the largest difference between two dark frames
constexpr double kClipped = 0.985;

double brightest_difference(const std::vector<double>& from, const std::vector<double>& to) {
  std::vector<double> differences(from.size());
  std::ranges::transform(to, from, differences.begin(), [](double b, double a) { return b - a; });
  const auto nth = differences.begin() + static_cast<std::ptrdiff_t>(kBrightest * static_cast<double>(from.size() - 1));
  std::nth_element(differences.begin(), nth, differences.end());
  return *nth;
}

/// The pixels of a camera that see the projector change from black to white, and their brightness in both.
class FlashPixels {
 public:
  /// Samples of a frame at fixed pixels: few, to save time; copied, so that the frame can return to its driver.
  using Samples = std::vector<double>;
  [[nodiscard]] static Samples sample(const GreyView& frame);

  /// @param dark, of two black frames: their difference is noise, or a person passing by
  /// @param lit               of a white frame
  /// @errors kNotFound: no flash is visible; kMismatch: frames of different sizes
  [[nodiscard]] static Result<FlashPixels> find(const Samples& dark, const Samples& dark_again, const Samples& lit);

  /// The share of white reached. @param frame  of the same size @return about 0 for black, 1 for white
  [[nodiscard]] double share_of_white(const Samples& frame) const;

  /// Tells whether most of the pixels are saturated. Then a part of the white looks like all of it, and its onset seems
  /// early.
  [[nodiscard]] bool clipped() const { return clipped_; }

 private:
  std::vector<std::size_t> chosen_;  ///< indices in the samples of a frame
  double dark_ = 0;                  ///< sum over them
  double lit_ = 0;
  bool clipped_ = false;
};

FlashPixels::Samples FlashPixels::sample(const GreyView& frame) {
  Samples samples;
  std::visit(
      [&](const auto& image) {
        const int step = std::max(1, image.width / kSamplesAcross);
        for (int y = 0; y < image.height; y += step) {
          for (int x = 0; x < image.width; x += step) samples.push_back(image.at(x, y));
        }
      },
      frame);
  return samples;
}

Result<FlashPixels> FlashPixels::find(const Samples& dark, const Samples& dark_again, const Samples& lit) {
  if (dark.empty() || dark.size() != lit.size() || dark.size() != dark_again.size()) {
    return fail(ErrorCode::kMismatch, "the camera's frames differ in size: set its size");
  }
  const double flash = brightest_difference(dark, lit);
  const double noise = std::abs(brightest_difference(dark, dark_again));
  if (flash < kAboveNoise * noise + 1) {
    return fail(ErrorCode::kNotFound,
                "the camera saw no flash: point it at the projected area, take the lens caps off, darken the room, and "
                "allow a longer exposure");
  }
  FlashPixels pixels;
  const double highest = *std::ranges::max_element(lit);
  std::size_t saturated = 0;
  for (std::size_t i = 0; i < dark.size(); ++i) {
    if (lit[i] - dark[i] < kChosen * flash) continue;
    pixels.chosen_.push_back(i);
    pixels.dark_ += dark[i];
    pixels.lit_ += lit[i];
    saturated += lit[i] >= kClipped * highest ? 1 : 0;
  }
  // Only the highest level of 8, 10, 12 or 16 bits counts, nothing in between.
  const bool at_end = highest >= 255 && std::fmod(std::log2(highest + 1), 1.0) == 0;
  pixels.clipped_ = at_end && 2 * saturated > pixels.chosen_.size();
  return pixels;
}

double FlashPixels::share_of_white(const Samples& frame) const {
  double sum = 0;
  for (const std::size_t i : chosen_) sum += i < frame.size() ? frame[i] : 0;
  return (sum - dark_) / (lit_ - dark_);
}

bool only_this_frame(ErrorCode code) {
  return code == ErrorCode::kFrameDropped || code == ErrorCode::kFrameTorn || code == ErrorCode::kFrameStale ||
         code == ErrorCode::kFrameLate || code == ErrorCode::kMismatch;
}

/// The times of one flash.
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
    auto shown = projector_.show(image, time_.now() + kShowTime);
    if (shown) time_.sleep(options_.settle + more);
    return shown;
  }

  /// The part of a frame that matters here.
  struct Seen {
    FlashPixels::Samples samples;
    MonotonicTime exposure_start;
  };

  Result<Seen> capture() {
    for (int lost = 0;; ++lost) {
      const auto frame = camera_.capture(time_.now() + options_.timeout);
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
    const auto shown = projector_.show(white_, time_.now() + kShowTime);
    if (!shown) return tl::unexpected(shown.error());
    Flash flash;
    while (time_.now() < *shown + options_.timeout) {
      const auto seen = capture();
      if (!seen) return tl::unexpected(seen.error());
      flash.first_whole = seen->exposure_start - *shown;
      if (pixels.share_of_white(seen->samples) >= kWhole) return flash;
      flash.last_incomplete = flash.first_whole;
    }
    return fail(ErrorCode::kTimeout,
                "the camera missed a flash: let nothing move between projector and camera, and measure again");
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
      const auto index = static_cast<std::size_t>(std::lround(share * static_cast<double>(whole.size() - 1)));
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
