// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <chrono>

#include "core/decode/decoding.hpp"

namespace slsd {

using StageTimes = std::array<std::chrono::nanoseconds, kStageCount>;

/// Takes the time of each stage of a decode; over several frames the times add up.
/// @thread thread-bound
class StageClock final : public StageObserver {
 public:
  void start() { last_ = std::chrono::steady_clock::now(); }

  void stage_done(Stage stage) override {
    const auto now = std::chrono::steady_clock::now();
    times_[static_cast<std::size_t>(stage)] += now - last_;
    last_ = now;
  }

  [[nodiscard]] const StageTimes& times() const { return times_; }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  StageTimes times_{};
};

}  // namespace slsd
