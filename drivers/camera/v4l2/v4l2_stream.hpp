// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <linux/videodev2.h>

#include "core/result.hpp"
#include "drivers/camera/frame.hpp"
#include "drivers/camera/v4l2/mapped_buffers.hpp"
#include "drivers/camera/v4l2/v4l2_device.hpp"

namespace slsd {

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
  [[nodiscard]] const MappedBuffers& buffers() const { return buffers_; }

  /// A buffer that the driver has done with, or nothing if there is none.
  /// @errors kIo (passing: this frame is lost), kDisconnected
  [[nodiscard]] Result<std::optional<v4l2_buffer>> take();
  /// Gives it to the driver again. @errors kDisconnected
  [[nodiscard]] Result<> put_back(std::size_t buffer);
  /// Gives the driver those that frames gave back, until it has so many. @errors kDisconnected
  [[nodiscard]] Result<> put_back_returned(std::size_t queued_max = VIDEO_MAX_FRAME);

  [[nodiscard]] Frame lend(std::size_t buffer, const GreyView& image, std::uint64_t sequence,
                           MonotonicTime exposure_start, MonotonicTime received);

  /// Since when the driver has had buffers to fill and has filled none; never, where it has none.
  [[nodiscard]] MonotonicTime quiet_since() const { return queued_ > 0 ? quiet_since_ : MonotonicTime::max(); }

  /// How many the driver has.
  [[nodiscard]] std::size_t queued() const { return queued_; }
  [[nodiscard]] std::size_t lent() const;

 private:
  V4l2Stream(V4l2Device device, MappedBuffers buffers);

  V4l2Device device_;
  MappedBuffers buffers_;
  std::array<bool, VIDEO_MAX_FRAME> with_driver_{};
  std::size_t queued_ = 0;
  MonotonicTime quiet_since_{};
};

}  // namespace slsd
