// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <utility>

#include "core/image.hpp"

namespace slsd {

/// CLOCK_MONOTONIC.
using MonotonicTime = std::chrono::time_point<std::chrono::steady_clock, std::chrono::nanoseconds>;

/// One frame of one camera: a lease on a buffer of the driver's, given back by the destructor.
/// @thread thread-bound; may be moved between threads
class Frame {
 public:
  /// @param sequence        counts the device's frames from open() on; a gap tells of a lost frame
  /// @param exposure_start  when its exposure began, as the device says; an old one tells of a stale frame
  /// @param received        when its last byte was there
  /// @param give_back       called once, on whichever thread ends the lease, even after the camera's end
  Frame(GreyView image, std::uint64_t sequence, MonotonicTime exposure_start, MonotonicTime received,
        std::function<void()> give_back)
      : image_(image),
        sequence_(sequence),
        exposure_start_(exposure_start),
        received_(received),
        give_back_(std::move(give_back)) {}
  Frame(Frame&& other) noexcept
      : image_(other.image_),
        sequence_(other.sequence_),
        exposure_start_(other.exposure_start_),
        received_(other.received_),
        give_back_(std::exchange(other.give_back_, nullptr)) {}
  Frame& operator=(Frame&& other) noexcept {
    std::swap(image_, other.image_);
    std::swap(sequence_, other.sequence_);
    std::swap(exposure_start_, other.exposure_start_);
    std::swap(received_, other.received_);
    std::swap(give_back_, other.give_back_);
    return *this;
  }
  ~Frame() {
    if (give_back_) give_back_();
  }

  [[nodiscard]] const GreyView& image() const { return image_; }
  [[nodiscard]] std::uint64_t sequence() const { return sequence_; }
  [[nodiscard]] MonotonicTime exposure_start() const { return exposure_start_; }
  [[nodiscard]] MonotonicTime received() const { return received_; }

  /// The same lease with other times, for a driver that corrects them.
  [[nodiscard]] Frame restamped(MonotonicTime exposure_start, MonotonicTime received) && {
    return {image_, sequence_, exposure_start, received, std::exchange(give_back_, nullptr)};
  }

 private:
  GreyView image_;
  std::uint64_t sequence_;
  MonotonicTime exposure_start_;
  MonotonicTime received_;
  std::function<void()> give_back_;
};

}  // namespace slsd
