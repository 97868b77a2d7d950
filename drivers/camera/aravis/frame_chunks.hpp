// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <bit>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "drivers/camera/aravis/aravis_camera_options.hpp"

namespace slsd {

/// Tells whether a frame is one image with chunks behind it and nothing else, as GigE Vision and USB3 Vision lay them
/// out. Each is followed by what tells its end only. So they are read from the last to the first, which is the image.
///
///     | image | id length | chunk | id length | chunk | id length |      id and length: 4 bytes each
///
/// A frame that ends too early, or whose end was written over, has another layout: unless what then stands at its end
/// happens to be a length that leads to another, as the id of a chunk cannot be, which is above any length.
/// @param frame        all that came
/// @param image_bytes  how many the image has; up to 3 more fill up its last word
/// @param order        of the bytes in an id or length: big on GigE Vision, little on USB3 Vision
/// @thread reentrant
[[nodiscard]] bool is_image_with_chunks(std::span<const std::uint8_t> frame, std::size_t image_bytes,
                                        std::endian order);

/// The data about one frame in the chunks behind its image. Each is set if the camera has such a chunk.
struct FrameChunks {
  std::optional<std::chrono::nanoseconds> exposure_start;  ///< in the device's clock
  std::optional<double> exposure_us;                       ///< real exposure time
  std::optional<double> gain_db;                           ///< real gain

  friend bool operator==(const FrameChunks&, const FrameChunks&) = default;
};

/// The settings of the frame that are not as configured, in words. Empty if all are, or if nothing is known.
/// @thread reentrant
[[nodiscard]] std::string unlike_configured(const FrameChunks& chunks, const AravisCameraOptions& options);

/// The time stamp of a chunk, which some cameras give in nanoseconds and some in their clock's ticks: whichever is
/// nearer to the time stamp that the frame begins with. That is of the same clock, and may be of the readout.
/// @param frame_stamp        the frame's own, by the device's clock
/// @param tick_frequency_hz  0: its ticks are nanoseconds
/// @param apart_max          beyond it both are of another clock, or of two frames
/// @return nothing if neither is within that
/// @thread reentrant
[[nodiscard]] std::optional<std::chrono::nanoseconds> chunk_time(std::uint64_t value,
                                                                 std::chrono::nanoseconds frame_stamp,
                                                                 std::uint64_t tick_frequency_hz,
                                                                 std::chrono::nanoseconds apart_max);

}  // namespace slsd
