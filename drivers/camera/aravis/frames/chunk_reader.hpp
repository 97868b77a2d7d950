// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <bit>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/camera/aravis/device/configure_device.hpp"
#include "drivers/camera/aravis/frames/frame_chunks.hpp"
#include "drivers/camera/aravis/g_object.hpp"

namespace slsd {

/// Reads the chunks that a camera appends to its frames, according to the camera's own description. Allocates no
/// memory. Aravis notes for each value the buffer that it was read from, in a few small blocks that it frees again.
/// @thread thread-bound
class ChunkReader {
 public:
  /// @param image_bytes  of each frame
  /// @param apart_max    the greatest difference between a frame's own time stamp and its exposure's start
  ChunkReader(ArvCamera* camera, const ChunkSelection& selection, std::size_t image_bytes,
              std::chrono::nanoseconds apart_max);
  /// Must end before the last buffer read, because Aravis observes that buffer.
  ~ChunkReader() = default;
  ChunkReader(const ChunkReader&) = delete;
  ChunkReader& operator=(const ChunkReader&) = delete;

  /// Reads the chunks of a successful buffer. If the camera stamps its chunks with another clock than its frames, they
  /// have no exposure start.
  /// @return nothing if the layout breaks the standards, a selected chunk is missing, or the chunks' time differs from
  ///         the frame's
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
  bool same_clock_ = false;  ///< both time stamps of some frame agreed
};

}  // namespace slsd
