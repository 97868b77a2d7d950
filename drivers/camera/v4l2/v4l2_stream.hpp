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

/// The driver's buffers, mapped, and lent to frames. They stay mapped until the last frame is given back, also after
/// the device was closed.
class MappedBuffers final : public LentBuffers {
 public:
  /// @param count  how many to ask the driver for, which may give more or fewer
  /// @errors kUnsupported (no memory mapping, or fewer than 3), kBusy, kDisconnected, kIo
  [[nodiscard]] static Result<std::shared_ptr<MappedBuffers>> request(const V4l2Device& device, int count);
  explicit MappedBuffers(std::size_t count) : LentBuffers(count) {}
  ~MappedBuffers() override;

  [[nodiscard]] std::span<std::byte> bytes(std::size_t buffer) const { return mapped_[buffer]; }

 private:
  [[nodiscard]] Result<> map(const V4l2Device& device, std::size_t buffer);

  std::array<std::span<std::byte>, VIDEO_MAX_FRAME> mapped_{};
};

/// The buffers' way round between driver, camera and frames, while the device is streaming.
/// @thread thread-bound
class V4l2Stream {
 public:
  /// @errors as MappedBuffers::request(); kNoSpace (not enough bandwidth on its bus)
  [[nodiscard]] static Result<V4l2Stream> start(V4l2Device device, int buffers);
  V4l2Stream(V4l2Stream&&) = default;
  V4l2Stream& operator=(V4l2Stream&&) = delete;
  /// Stops streaming and gives the buffers back to the driver; those that are lent live on by themselves.
  ~V4l2Stream();

  [[nodiscard]] const V4l2Device& device() const { return device_; }
  [[nodiscard]] const MappedBuffers& buffers() const { return *buffers_; }

  /// A buffer that the driver has done with, or nothing if there is none.
  /// @errors kIo (passing: this frame is lost), kDisconnected
  [[nodiscard]] Result<std::optional<v4l2_buffer>> take();
  /// Gives it to the driver again. @errors kDisconnected
  [[nodiscard]] Result<> put_back(std::size_t buffer);
  /// Gives the driver those that frames gave back, until it has so many. @errors kDisconnected
  [[nodiscard]] Result<> put_back_returned(std::size_t queued_max = VIDEO_MAX_FRAME);

  /// Lends a buffer that the driver does not have.
  [[nodiscard]] FrameLease lend(std::size_t buffer) { return buffers_->lend(buffer); }

  /// The time since when the driver has had buffers to fill and has filled none; never, if it has none.
  [[nodiscard]] MonotonicTime quiet_since() const { return queued_ > 0 ? quiet_since_ : MonotonicTime::max(); }

  /// The number of buffers that the driver has.
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
