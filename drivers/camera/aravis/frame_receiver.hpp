// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/image.hpp"
#include "core/result.hpp"
#include "drivers/camera/aravis/aravis_camera_options.hpp"
#include "drivers/camera/aravis/aravis_statistics.hpp"
#include "drivers/camera/aravis/chunk_reader.hpp"
#include "drivers/camera/aravis/configure_device.hpp"
#include "drivers/camera/aravis/device_clock.hpp"
#include "drivers/camera/aravis/frame_ids.hpp"
#include "drivers/camera/aravis/g_object.hpp"
#include "drivers/camera/aravis/stream_buffers.hpp"
#include "drivers/camera/frame.hpp"
#include "drivers/camera/frame_pool.hpp"

namespace slsd {

/// Turns the buffers of a stream into frames, and refuses those that are not what was asked for.
/// @thread thread-bound
class FrameReceiver {
 public:
  /// @param stream         outlives this
  /// @param payload_bytes  of a frame, with what the camera appends to it
  /// @param chunks         of the camera; null where it appends none
  FrameReceiver(ArvStream* stream, const DeviceLayout& layout, const AravisCameraOptions& options,
                std::size_t payload_bytes, std::unique_ptr<ChunkReader> chunks);

  /// Begins to count anew.
  void restart();

  [[nodiscard]] bool all_held() const { return buffers_.lent() >= options_.frames_held_max; }

  /// Takes the next buffer of the stream, which is done.
  /// @param asked  frames exposed before are stale
  /// @param clock  of the device; where it is not ready the exposure is taken to end when the frame is there
  /// @return nothing if the stream gave a buffer up without a frame
  /// @errors kFrameTorn, kFrameStale, kBusy; kMismatch: exposed with other settings than configured
  [[nodiscard]] Result<std::optional<Frame>> take(MonotonicTime asked, const DeviceClock& clock);
  /// Takes the next buffer and gives it back.
  void discard();
  /// As discard(). @return false if it is a frame whose chunks cannot be read
  [[nodiscard]] bool discard_readable();
  /// Gives back all that are done.
  void discard_all();

  [[nodiscard]] AravisStatistics statistics() const;

 private:
  [[nodiscard]] ArvBuffer* pop();
  void return_unread(ArvBuffer* buffer);
  [[nodiscard]] std::string wrong_with(ArvBuffer* buffer) const;
  [[nodiscard]] std::optional<FrameChunks> read_chunks(ArvBuffer* buffer);
  [[nodiscard]] tl::unexpected<Error> refuse(ArvBuffer* buffer, std::uint64_t& count, ErrorCode code,
                                             std::string message);
  void note_identifier(ArvBuffer* buffer);
  [[nodiscard]] std::optional<MonotonicTime> exposure_start(ArvBuffer* buffer, const FrameChunks& chunks,
                                                            MonotonicTime asked, const DeviceClock& clock) const;
  [[nodiscard]] Result<std::optional<Frame>> deliver(ArvBuffer* buffer, MonotonicTime exposure_start);
  [[nodiscard]] GreyView view(ArvBuffer* buffer) const;
  [[nodiscard]] std::optional<Frame> as_grey(ArvBuffer* buffer, MonotonicTime exposure_start);

  ArvStream* stream_;
  DeviceLayout layout_;
  const AravisCameraOptions& options_;
  StreamBuffers buffers_;
  std::unique_ptr<ChunkReader> chunks_;  ///< ends before the buffers
  FrameIds ids_;
  std::uint64_t underruns_ = 0;
  bool ran_out_ = false;  ///< of buffers, before a gap in the identifiers that has not come yet
  AravisStatistics counted_;
  std::optional<FramePool> greys_;  ///< of mosaics turned into grey, and of packed pixels unpacked
  Grey8 grey8_;
  Grey16 grey16_;
  std::vector<std::uint32_t> sums_;
};

}  // namespace slsd
