// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <chrono>
#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "drivers/camera/camera.hpp"
#include "drivers/projector/projector.hpp"
#include "programs/latency/timepiece.hpp"

namespace slsd {

/// Time that passes only when somebody waits, the light that a late projector throws, and a camera that runs freely and
/// sees it: what a latency is measured on, with the truth known.
class DarkRoom {
 public:
  std::chrono::nanoseconds refresh{16'666'667};
  std::chrono::nanoseconds late{0};            ///< from what show() returned to the light
  std::chrono::nanoseconds frame{33'000'000};  ///< the camera's period
  std::chrono::nanoseconds exposure{16'666'667};
  double ambient = 20;
  double white = 180;  ///< above ambient
  int lost_every = 0;  ///< of the camera's frames; 0: none

  [[nodiscard]] Timepiece timepiece() {
    return {[this] { return now_; }, [this](auto time) { now_ += time; }};
  }

  /// @return when the driver says that it is visible
  MonotonicTime show(bool lit) {
    now_ += refresh - (now_.time_since_epoch() % refresh);
    changes_.emplace_back(now_ + late, lit);
    return now_;
  }

  /// Exposes at the camera's own next time, and lets it pass. @return when it began
  MonotonicTime expose() {
    now_ += (frame - now_.time_since_epoch() % frame) % frame;
    const MonotonicTime start = now_;
    now_ += exposure;
    return start;
  }

  /// The share of an exposure during which the projector was white.
  [[nodiscard]] double lit_share(MonotonicTime start) const {
    std::chrono::nanoseconds lit{0};
    for (std::size_t i = 0; i < changes_.size(); ++i) {
      if (!changes_[i].second) continue;
      const MonotonicTime end = i + 1 < changes_.size() ? changes_[i + 1].first : MonotonicTime::max();
      const auto overlap = std::min(end, start + exposure) - std::max(changes_[i].first, start);
      lit += std::max(overlap, std::chrono::nanoseconds(0));
    }
    return static_cast<double>(lit.count()) / static_cast<double>(exposure.count());
  }

 private:
  MonotonicTime now_{std::chrono::seconds(1000)};
  std::deque<std::pair<MonotonicTime, bool>> changes_;
};

/// A projector whose light comes later than it says.
class LateProjector final : public Projector {
 public:
  explicit LateProjector(DarkRoom& room) : room_(room) {}
  [[nodiscard]] const ProjectorDescription& description() const override { return description_; }
  [[nodiscard]] Result<> open(MonotonicTime) override { return {}; }
  [[nodiscard]] Result<MonotonicTime> show(const Grey8& image, MonotonicTime) override {
    return room_.show(image.at(0, 0) > 0);
  }
  [[nodiscard]] Result<> check(MonotonicTime) override { return {}; }
  [[nodiscard]] std::vector<std::string> warnings() const override { return {}; }
  [[nodiscard]] Result<Grey8> read_back() override { return Grey8(); }

 private:
  DarkRoom& room_;
  ProjectorDescription description_{"late", "", 64, 48};
};

/// A camera that runs freely in that room; half of what it sees is lit.
class RoomCamera final : public Camera {
 public:
  explicit RoomCamera(DarkRoom& room) : room_(room) {}
  [[nodiscard]] const CameraDescription& description() const override { return description_; }
  [[nodiscard]] Result<> open() override { return {}; }
  [[nodiscard]] Result<Frame> capture(MonotonicTime) override {
    const MonotonicTime start = room_.expose();
    ++sequence_;
    if (room_.lost_every > 0 && sequence_ % static_cast<std::uint64_t>(room_.lost_every) == 0) {
      return fail(ErrorCode::kFrameDropped, "lost");
    }
    const double lit = room_.white * room_.lit_share(start);
    Grey8& image = images_.emplace_back(description_.width_px, description_.height_px, 0);
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        const double light = x < image.width() / 2 ? lit : 0;
        image.at(x, y) = static_cast<std::uint8_t>(std::min(255.0, room_.ambient + light));
      }
    }
    return Frame(image.view(), sequence_, start, start + room_.exposure);
  }
  void cancel() override {}

 private:
  DarkRoom& room_;
  CameraDescription description_{"left", "room", "room", 32, 24};
  std::deque<Grey8> images_;
  std::uint64_t sequence_ = 0;
};

}  // namespace slsd
