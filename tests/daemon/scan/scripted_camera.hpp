// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "core/image.hpp"
#include "drivers/camera/camera.hpp"
#include "drivers/system/wake_event.hpp"

namespace slsd {

/// A camera that does at each capture what its script says, and after that gives frames as it should.
class ScriptedCamera final : public Camera {
 public:
  using Step = std::function<Result<Frame>(ScriptedCamera&, MonotonicTime deadline)>;

  ScriptedCamera(std::string name, const Grey8& image, std::deque<Step> script = {})
      : image_(image), script_(std::move(script)) {
    description_ = {std::move(name), "scripted", "scripted", image.width(), image.height()};
  }

  [[nodiscard]] const CameraDescription& description() const override { return description_; }
  void set_found(std::function<void()> found) override { found_ = std::move(found); }
  [[nodiscard]] Result<> open() override {
    ++opens;
    if (gone) return fail(ErrorCode::kNotFound, "unplugged");
    if (found_) found_();
    if (configured) configured->wait();
    if (const auto error = open_error.load()) return fail(*error, "as told");
    if (opens_to_fail > 0 && opens_to_fail-- > 0) return fail(ErrorCode::kNotFound, "no such device");
    return {};
  }
  [[nodiscard]] std::chrono::nanoseconds open_time_max() const override { return open_time; }
  [[nodiscard]] std::chrono::nanoseconds frame_time_max() const override { return frame_time; }
  [[nodiscard]] Result<Frame> capture(MonotonicTime deadline) override {
    ++captures;
    if (script_.empty()) return frame(std::chrono::steady_clock::now());
    const Step step = std::move(script_.front());
    script_.pop_front();
    return step(*this, deadline);
  }
  [[nodiscard]] Result<> check() override {
    if (gone) return fail(ErrorCode::kDisconnected, "unplugged");
    return {};
  }
  void cancel() override { cancelled_.wake(); }

  /// As a capture that nothing else ends.
  [[nodiscard]] Result<Frame> wait_cancelled(MonotonicTime deadline) {
    if (auto opened = cancelled_.open(); !opened) return tl::unexpected(opened.error());
    if (cancelled_.sleep_until(deadline)) return fail(ErrorCode::kCancelled, "the capture was cancelled");
    return fail(ErrorCode::kFrameLate, "no frame came");
  }

  [[nodiscard]] Frame frame(MonotonicTime exposure_start) {
    return Frame(image_.view(), sequence_++, exposure_start, std::chrono::steady_clock::now());
  }

  /// As if the device had lost them.
  void skip_frames(std::uint64_t count) { sequence_ += count; }

  std::chrono::nanoseconds open_time = Camera::open_time_max();
  std::chrono::nanoseconds frame_time = std::chrono::seconds(5);
  std::atomic<int> captures{0};
  int opens_to_fail = 0;
  std::atomic<int> opens{0};
  std::optional<std::shared_future<void>> configured;  ///< what open() waits for once the device is found
  std::atomic<std::optional<ErrorCode>> open_error{std::nullopt};
  std::atomic<bool> gone{false};  ///< as check() and open() find it

 private:
  const Grey8& image_;
  std::deque<Step> script_;
  CameraDescription description_;
  std::function<void()> found_;
  std::uint64_t sequence_ = 0;
  WakeEvent cancelled_;  // left set by a cancel() that met nobody
};

}  // namespace slsd
