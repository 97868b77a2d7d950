// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>

#include "core/image.hpp"
#include "drivers/camera/camera.hpp"

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
  [[nodiscard]] Result<> open() override {
    if (opens_to_fail > 0 && opens_to_fail-- > 0) return fail(ErrorCode::kNotFound, "no such device");
    return {};
  }
  [[nodiscard]] Result<Frame> capture(MonotonicTime deadline) override {
    if (script_.empty()) return frame(std::chrono::steady_clock::now());
    const Step step = std::move(script_.front());
    script_.pop_front();
    return step(*this, deadline);
  }
  void cancel() override {}

  [[nodiscard]] Frame frame(MonotonicTime exposure_start) {
    return Frame(image_.view(), sequence_++, exposure_start, std::chrono::steady_clock::now(), [] {});
  }

  int opens_to_fail = 0;

 private:
  const Grey8& image_;
  std::deque<Step> script_;
  CameraDescription description_;
  std::uint64_t sequence_ = 0;
};

}  // namespace slsd
