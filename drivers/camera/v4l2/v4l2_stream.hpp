// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include <linux/videodev2.h>

#include "core/result.hpp"
#include "drivers/camera/frame.hpp"
#include "drivers/camera/v4l2/v4l2_device.hpp"

namespace slsd {

/// The driver's mapped buffers, lent to frames. They stay mapped until the last frame is given back, even after the
/// device was closed.
class MappedBuffers final : public LentBuffers {
 public:
  /// @param count  number to request; the driver may give more or fewer
  /// @errors kUnsupported (no memory mapping, or fewer than 3), kBusy, kDisconnected, kIo
  [[nodiscard]] static Result<std::shared_ptr<MappedBuffers>> request(const V4l2Device& device, int count);
  explicit MappedBuffers(std::size_t count) : LentBuffers(count) {}
  ~MappedBuffers() override;

  [[nodiscard]] std::span<std::byte> bytes(std::size_t buffer) const { return mapped_[buffer]; }

 private:
  [[nodiscard]] Result<> map(const V4l2Device& device, std::size_t buffer);

  std::array<std::span<std::byte>, VIDEO_MAX_FRAME> mapped_{};
};

/// Circulates the buffers between driver, camera and frames while the device streams.
/// @thread thread-bound
class V4l2Stream {
 public:
  /// @errors as MappedBuffers::request(); kNoSpace (not enough bandwidth on its bus)
  [[nodiscard]] static Result<V4l2Stream> start(V4l2Device device, int buffers);
  V4l2Stream(V4l2Stream&&) = default;
  V4l2Stream& operator=(V4l2Stream&&) = delete;
  /// Stops streaming and returns the buffers to the driver; lent buffers live on.
  ~V4l2Stream();

  [[nodiscard]] const V4l2Device& device() const { return device_; }
  [[nodiscard]] const MappedBuffers& buffers() const { return *buffers_; }

  /// Takes a buffer that the driver has completed; nothing if there is none.
  /// @errors kIo (temporary: this frame is lost), kDisconnected
  [[nodiscard]] Result<std::optional<v4l2_buffer>> take();
  /// Returns the buffer to the driver. @errors kDisconnected
  [[nodiscard]] Result<> put_back(std::size_t buffer);
  /// Queues buffers that frames returned, until the driver has this many. @errors kDisconnected
  [[nodiscard]] Result<> put_back_returned(std::size_t queued_max = VIDEO_MAX_FRAME);

  /// Lends a buffer that is not queued at the driver.
  [[nodiscard]] FrameLease lend(std::size_t buffer) { return buffers_->lend(buffer); }

  /// The time since when the driver has had free buffers but completed none; the end of time if it has none.
  [[nodiscard]] MonotonicTime quiet_since() const { return queued_ > 0 ? quiet_since_ : MonotonicTime::max(); }

  /// The number of buffers queued at the driver.
  [[nodiscard]] std::size_t queued() const { return queued_; }

 private:
  V4l2Stream(V4l2Device device, std::shared_ptr<MappedBuffers> buffers);

  V4l2Device device_;
  std::shared_ptr<MappedBuffers> buffers_;  ///< shared with the frames
  std::array<bool, VIDEO_MAX_FRAME> with_driver_{};
  std::size_t queued_ = 0;
  MonotonicTime quiet_since_{};
};

}  // namespace slsd
