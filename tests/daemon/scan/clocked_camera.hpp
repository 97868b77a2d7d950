// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <thread>
#include <utility>

#include "core/image.hpp"
#include "drivers/camera/camera.hpp"

namespace slsd {

/// A camera that runs freely: exposes at fixed moments, keeps what nobody took, and numbers its frames by the moment.
class ClockedCamera final : public Camera {
 public:
  /// @param start  when the frame 0 is exposed
  ClockedCamera(std::string name, const Grey8& image, MonotonicTime start, std::chrono::nanoseconds period)
      : image_(image), start_(start), period_(period) {
    description_ = {std::move(name), "clocked",      "clocked",
                    image.width(),   image.height(), 1.0 / std::chrono::duration<double>(period).count()};
  }

  [[nodiscard]] const CameraDescription& description() const override { return description_; }
  [[nodiscard]] Result<> open() override { return {}; }
  [[nodiscard]] Result<Frame> capture(MonotonicTime) override {
    const auto since = std::chrono::steady_clock::now() - start_;
    return expose(since < since.zero() ? 0 : static_cast<std::uint64_t>(since / period_) + 1);
  }
  [[nodiscard]] Result<Frame> capture_next(MonotonicTime) override { return expose(last_ + 1); }
  void cancel() override {}

 private:
  Frame expose(std::uint64_t number) {
    last_ = number;
    const MonotonicTime exposure_start = start_ + static_cast<std::int64_t>(number) * period_;
    std::this_thread::sleep_until(exposure_start);
    return {image_.view(), number, exposure_start, std::chrono::steady_clock::now()};
  }

  const Grey8& image_;
  MonotonicTime start_;
  std::chrono::nanoseconds period_;
  std::uint64_t last_ = 0;
  CameraDescription description_;
};

}  // namespace slsd
