// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "core/image.hpp"
#include "drivers/camera/frame.hpp"

namespace slsd {

/// The size and depth of a camera's frames.
struct FrameFormat {
  int width_px = 0;
  int height_px = 0;
  int bytes_per_pixel = 1;  ///< 1 or 2

  friend bool operator==(const FrameFormat&, const FrameFormat&) = default;
};

[[nodiscard]] FrameFormat format_of(const GreyView& image);

/// A fixed number of buffers for frames, all allocated at the start. Frames may outlive the pool: the last owner frees
/// the buffers.
/// @thread thread-bound; frames may end on any thread
class FramePool {
 public:
  FramePool(FrameFormat format, int buffers);

  [[nodiscard]] const FrameFormat& format() const;

  /// Tells whether no buffer is free. May or may not count a lease that ends on another thread during the call.
  [[nodiscard]] bool all_lent() const;

  /// Copies the pixels into a free buffer; nothing if all are lent.
  /// @param image  of the pool's format
  [[nodiscard]] std::optional<Frame> lend(const GreyView& image, std::uint64_t sequence, MonotonicTime exposure_start);

 private:
  struct Buffers;
  std::shared_ptr<Buffers> buffers_;  ///< shared with the frames
};

}  // namespace slsd
