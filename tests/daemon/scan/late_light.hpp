// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/image.hpp"
#include "drivers/camera/camera.hpp"
#include "drivers/camera/frame_pool.hpp"
#include "drivers/projector/headless_projector.hpp"

namespace slsd {

/// The light of a projector that is late: which of some pictures falls on the scene, and when.
/// @thread thread-safe
class LateLight {
 public:
  struct Picture {
    Grey8 shown;  ///< by the projector
    Grey8 seen;   ///< by a camera
  };
  /// What an exposure saw: a picture alone, or two in parts.
  struct Sight {
    std::size_t picture = 0;
    std::optional<std::size_t> other;
  };

  /// @param pictures  all that will be shown
  LateLight(std::vector<Picture> pictures, std::chrono::nanoseconds refresh, int late_refreshes)
      : pictures_(std::move(pictures)), refresh_(refresh), late_(late_refreshes * refresh) {}

  [[nodiscard]] const Grey8& seen(std::size_t picture) const { return pictures_[picture].seen; }
  [[nodiscard]] std::chrono::nanoseconds refresh() const { return refresh_; }

  /// The image's first refresh, row after row, ends then; its light does so late.
  void change(const Grey8& image, MonotonicTime complete) {
    std::size_t picture = 0;
    while (picture < pictures_.size() && !(pictures_[picture].shown == image)) ++picture;
    const std::lock_guard lock(mutex_);
    changes_.push_back({complete - refresh_ + late_, complete + late_, picture});
    if (changes_.size() > kKept) changes_.pop_front();
  }

  /// What the frame of that number sees, exposed between these times.
  Sight expose(std::uint64_t sequence, MonotonicTime from, MonotonicTime to) {
    const std::lock_guard lock(mutex_);
    return sights_[sequence] = sight(from, to);
  }
  /// The same again, even when the camera is closed.
  [[nodiscard]] Sight sight_of(std::uint64_t sequence) const {
    const std::lock_guard lock(mutex_);
    return sights_.at(sequence);
  }

 private:
  [[nodiscard]] Sight sight(MonotonicTime from, MonotonicTime to) const {
    std::size_t last = changes_.size();
    while (last > 0 && changes_[last - 1].begin >= to) --last;
    if (last == 0) return {0, 0};
    const Change& change = changes_[last - 1];
    if (change.end <= from) return {change.picture, std::nullopt};
    return {change.picture, last > 1 ? changes_[last - 2].picture : change.picture};
  }

  static constexpr std::size_t kKept = 64;
  struct Change {
    MonotonicTime begin;
    MonotonicTime end;
    std::size_t picture;
  };
  std::vector<Picture> pictures_;
  std::chrono::nanoseconds refresh_;
  std::chrono::nanoseconds late_;
  mutable std::mutex mutex_;
  std::deque<Change> changes_;
  std::unordered_map<std::uint64_t, Sight> sights_;
};

/// The headless projector, with that light.
class LateHeadless final : public Projector {
 public:
  LateHeadless(LateLight& light, HeadlessProjectorOptions options) : light_(light), projector_(std::move(options)) {}
  [[nodiscard]] const ProjectorDescription& description() const override { return projector_.description(); }
  [[nodiscard]] Result<> open(MonotonicTime deadline) override {
    auto opened = projector_.open(deadline);
    const auto& description = projector_.description();
    if (opened) light_.change(Grey8(description.width_px, description.height_px), std::chrono::steady_clock::now());
    return opened;
  }
  [[nodiscard]] Result<MonotonicTime> show(const Grey8& image, MonotonicTime deadline) override {
    const auto complete = projector_.show(image, deadline);
    if (complete) light_.change(*projector_.read_back(), *complete);
    return complete;
  }
  [[nodiscard]] Result<> check(MonotonicTime deadline) override { return projector_.check(deadline); }
  [[nodiscard]] std::vector<std::string> warnings() const override { return {}; }
  [[nodiscard]] Result<Grey8> read_back() override { return projector_.read_back(); }

 private:
  LateLight& light_;
  HeadlessProjector projector_;
};

/// A camera in that light, whose exposures last one to two refreshes: at the trigger, or at moments of its own.
class LightCamera final : public Camera {
 public:
  /// @param period  0: exposes at the trigger
  LightCamera(LateLight& light, std::chrono::nanoseconds period)
      : light_(light), period_(period), pool_({light.seen(0).width(), light.seen(0).height(), 1}, 8) {
    const double rate_hz = period.count() > 0 ? 1e9 / static_cast<double>(period.count()) : 0;
    description_ = {"camera", "light", "light", light.seen(0).width(), light.seen(0).height(), rate_hz};
  }

  [[nodiscard]] const CameraDescription& description() const override { return description_; }
  [[nodiscard]] Result<> open() override { return {}; }
  [[nodiscard]] Result<Frame> capture(MonotonicTime) override {
    const auto now = std::chrono::steady_clock::now();
    if (period_.count() == 0) return expose(now, sequence_ + 1);
    const auto number = now.time_since_epoch() / period_ + 1;
    return expose(MonotonicTime(number * period_), static_cast<std::uint64_t>(number));
  }
  [[nodiscard]] Result<Frame> capture_next(MonotonicTime deadline) override {
    if (period_.count() == 0) return capture(deadline);
    const auto oldest = static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch() / period_) - 2;
    const std::uint64_t number = std::max(sequence_ + 1, oldest);
    return expose(MonotonicTime(static_cast<std::int64_t>(number) * period_), number);
  }
  void cancel() override {}

 private:
  Result<Frame> expose(MonotonicTime start, std::uint64_t number) {
    sequence_ = number;
    const MonotonicTime end = start + light_.refresh() + light_.refresh() * (random_() % 1000) / 1000;
    std::this_thread::sleep_until(end);
    const LateLight::Sight sight = light_.expose(number, start, end);
    auto frame = pool_.lend(image_of(sight).view(), number, start);
    if (!frame) return fail(ErrorCode::kBusy, "all frames are held");
    return std::move(*frame);
  }

  const Grey8& image_of(const LateLight::Sight& sight) {
    const Grey8& seen = light_.seen(sight.picture);
    if (!sight.other) return seen;
    const Grey8& other = light_.seen(*sight.other);
    mixed_ = seen;
    for (std::size_t i = 0; i < mixed_.size(); ++i) {
      mixed_.data()[i] = static_cast<std::uint8_t>((seen.data()[i] + other.data()[i]) / 2);
    }
    return mixed_;
  }

  LateLight& light_;
  std::chrono::nanoseconds period_;
  FramePool pool_;
  CameraDescription description_;
  std::mt19937 random_{1};
  std::uint64_t sequence_ = 0;
  Grey8 mixed_;
};

}  // namespace slsd
