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

/// Tells whether a frame consists of one image followed by chunks, as GigE Vision and USB3 Vision lay them out. A
/// chunk's length stands only at its end, so this reads from the last chunk to the first, which is the image.
///
///     | image | id length | chunk | id length | chunk | id length |      id and length: 4 bytes each
///
/// Rejects a frame that ends too early or whose end was overwritten. An exception would need bytes at its end that
/// happen to be a valid length; the id of a chunk cannot be one, because it exceeds every length.
/// @param frame        all received bytes
/// @param image_bytes  size of the image; up to 3 more bytes fill its last word
/// @param order        of the bytes in an id or length: big on GigE Vision, little on USB3 Vision
/// @thread reentrant
[[nodiscard]] bool is_image_with_chunks(std::span<const std::uint8_t> frame, std::size_t image_bytes,
                                        std::endian order);

/// The data in the chunks behind a frame's image. Each field is set if the camera has its chunk.
struct FrameChunks {
  std::optional<std::chrono::nanoseconds> exposure_start;  ///< by the device's clock
  std::optional<double> exposure_us;                       ///< real exposure time
  std::optional<double> gain_db;                           ///< real gain

  friend bool operator==(const FrameChunks&, const FrameChunks&) = default;
};

/// Names the frame's settings that differ from the configuration. Empty if none does, or if nothing is known.
/// @thread reentrant
[[nodiscard]] std::string unlike_configured(const FrameChunks& chunks, const AravisCameraOptions& options);

/// Interprets a chunk's time stamp, which is in nanoseconds or in clock ticks depending on the camera. Chooses the
/// reading nearer to the frame's own stamp, which is of the same clock but may mark the readout.
/// @param frame_stamp        the frame's own, by the device's clock
/// @param tick_frequency_hz  0: ticks are nanoseconds
/// @param apart_max          a greater difference means another clock or another frame
/// @return nothing if neither reading is that close
/// @thread reentrant
[[nodiscard]] std::optional<std::chrono::nanoseconds> chunk_time(std::uint64_t value,
                                                                 std::chrono::nanoseconds frame_stamp,
                                                                 std::uint64_t tick_frequency_hz,
                                                                 std::chrono::nanoseconds apart_max);

}  // namespace slsd
