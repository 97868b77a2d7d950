// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <bit>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/camera/aravis/configure_device.hpp"
#include "drivers/camera/aravis/frame_chunks.hpp"
#include "drivers/camera/aravis/g_object.hpp"

namespace slsd {

/// Reads what a camera appended to its frames, by the camera's own description of it. Nothing is allocated here; Aravis
/// notes for each value which buffer it was read from, in a few small blocks that it frees again.
/// @thread thread-bound
class ChunkReader {
 public:
  /// @param image_bytes  of each frame
  /// @param apart_max    how far a frame's own time stamp may be from its exposure's start
  ChunkReader(ArvCamera* camera, const ChunkSelection& selection, std::size_t image_bytes,
              std::chrono::nanoseconds apart_max);
  /// Has to end before the buffer that was read last: Aravis keeps an eye on it.
  ~ChunkReader() = default;
  ChunkReader(const ChunkReader&) = delete;
  ChunkReader& operator=(const ChunkReader&) = delete;

  /// The chunks of a buffer that is a success. A camera whose chunks are stamped by another clock than its frames has
  /// no exposure start.
  /// @return nothing if they are not laid out as the standards say, if one of the selection is missing, or if they are
  ///         of another time than the frame
  [[nodiscard]] std::optional<FrameChunks> read(ArvBuffer* buffer);

 private:
  struct Number {
    const char* name;
    bool is_float;
  };
  [[nodiscard]] bool is_laid_out(ArvBuffer* buffer) const;
  [[nodiscard]] std::optional<std::uint64_t> timestamp(ArvBuffer* buffer) const;
  [[nodiscard]] std::optional<double> value(const Number& number, ArvBuffer* buffer) const;

  GObjectPtr<ArvChunkParser> parser_;
  ChunkSelection selection_;
  std::size_t image_bytes_;
  std::chrono::nanoseconds apart_max_;
  std::uint64_t tick_frequency_hz_ = 0;
  std::endian order_ = std::endian::little;
  Number exposure_time_;
  Number gain_;
  bool same_clock_ = false;  ///< both time stamps of some frame were of one time
};

}  // namespace slsd
