// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/colour.hpp"
#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

/// CLOCK_MONOTONIC.
using MonotonicTime = std::chrono::time_point<std::chrono::steady_clock, std::chrono::nanoseconds>;

class FrameLease;

/// The buffers of a driver or a pool; each is lent to one frame at a time. The lender and the frames share them,
/// because frames may outlive their camera: the last owner frees the memory. Lending allocates nothing.
/// @thread lend() and its queries belong to one thread; a lease may end on any thread
class LentBuffers : public std::enable_shared_from_this<LentBuffers> {
 public:
  explicit LentBuffers(std::size_t count) : lent_(count) {}
  virtual ~LentBuffers() = default;
  LentBuffers(const LentBuffers&) = delete;
  LentBuffers& operator=(const LentBuffers&) = delete;

  [[nodiscard]] std::size_t size() const { return lent_.size(); }
  [[nodiscard]] bool is_lent(std::size_t buffer) const { return lent_[buffer].load(std::memory_order_acquire); }
  /// The number of lent buffers. May or may not count a lease that ends on another thread during the call.
  [[nodiscard]] std::size_t lent() const {
    return static_cast<std::size_t>(
        std::ranges::count_if(lent_, [](const auto& lent) { return lent.load(std::memory_order_acquire); }));
  }
  [[nodiscard]] std::optional<std::size_t> find_free() const {
    for (std::size_t i = 0; i < lent_.size(); ++i)
      if (!is_lent(i)) return i;
    return std::nullopt;
  }

  /// @param buffer  one that is not lent
  [[nodiscard]] FrameLease lend(std::size_t buffer);

 private:
  friend class FrameLease;
  void end_lease(std::size_t buffer) {
    lent_[buffer].store(false, std::memory_order_release);
    take_back(buffer);
  }
  /// Called with a buffer whose lease ended, for a driver that needs it back at once. Runs on the thread that ends the
  /// lease.
  virtual void take_back(std::size_t /*buffer*/) {}

  std::vector<std::atomic<bool>> lent_;
};

/// The lease of a buffer; its end returns the buffer.
class FrameLease {
 public:
  FrameLease() = default;  ///< holds no buffer
  FrameLease(FrameLease&&) noexcept = default;
  FrameLease& operator=(FrameLease&& other) noexcept {
    std::swap(buffers_, other.buffers_);
    std::swap(buffer_, other.buffer_);
    return *this;
  }
  ~FrameLease() {
    if (buffers_) buffers_->end_lease(buffer_);
  }

 private:
  friend class LentBuffers;
  FrameLease(std::shared_ptr<LentBuffers> buffers, std::size_t buffer)
      : buffers_(std::move(buffers)), buffer_(buffer) {}

  std::shared_ptr<LentBuffers> buffers_;
  std::size_t buffer_ = 0;
};

inline FrameLease LentBuffers::lend(std::size_t buffer) {
  lent_[buffer].store(true, std::memory_order_relaxed);
  return {shared_from_this(), buffer};
}

/// One frame of one camera: a lease on a buffer of the driver. The destructor returns the buffer.
/// @thread thread-bound; may be moved between threads
class Frame {
 public:
  /// @param sequence        counts the device's frames since open(); a gap shows a lost frame
  /// @param exposure_start  the device's time of the exposure's start; an old one shows a stale frame
  /// @param received        time when its last byte arrived
  /// @param lease           on the buffer that contains the image; nothing if the image outlives every frame
  Frame(GreyView image, std::uint64_t sequence, MonotonicTime exposure_start, MonotonicTime received,
        FrameLease lease = {})
      : image_(image),
        sequence_(sequence),
        exposure_start_(exposure_start),
        received_(received),
        lease_(std::move(lease)) {}

  [[nodiscard]] const GreyView& image() const { return image_; }
  [[nodiscard]] std::uint64_t sequence() const { return sequence_; }
  [[nodiscard]] MonotonicTime exposure_start() const { return exposure_start_; }
  [[nodiscard]] MonotonicTime received() const { return received_; }

  /// Converts the frame into colours. Empty: the camera sees none, or the projector showed the pattern.
  /// @errors of read_image()
  [[nodiscard]] Result<ColourFrame> colours() const { return read_colours_ ? read_colours_() : ColourFrame(); }
  [[nodiscard]] const std::function<Result<ColourFrame>()>& reader_of_colours() const { return read_colours_; }
  /// @param read  converts what it owns, because the driver gets its buffer back
  [[nodiscard]] Frame with_colours(std::function<Result<ColourFrame>()> read) && {
    read_colours_ = std::move(read);
    return std::move(*this);
  }

  /// The same lease with other times, for a driver that corrects them.
  [[nodiscard]] Frame restamped(MonotonicTime exposure_start, MonotonicTime received) && {
    return Frame(image_, sequence_, exposure_start, received, std::move(lease_)).with_colours(std::move(read_colours_));
  }

 private:
  GreyView image_;
  std::uint64_t sequence_;
  MonotonicTime exposure_start_;
  MonotonicTime received_;
  FrameLease lease_;
  std::function<Result<ColourFrame>()> read_colours_;
};

}  // namespace slsd
