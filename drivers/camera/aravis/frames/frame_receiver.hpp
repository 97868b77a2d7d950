// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/colour.hpp"
#include "core/image.hpp"
#include "core/result.hpp"
#include "core/shown_picture.hpp"
#include "drivers/camera/aravis/aravis_camera_options.hpp"
#include "drivers/camera/aravis/device/configure_device.hpp"
#include "drivers/camera/aravis/device/device_clock.hpp"
#include "drivers/camera/aravis/frames/chunk_reader.hpp"
#include "drivers/camera/aravis/frames/frame_counts.hpp"
#include "drivers/camera/aravis/g_object.hpp"
#include "drivers/camera/frame.hpp"
#include "drivers/camera/frame_pool.hpp"

namespace slsd {

/// The buffers of one stream. Each is either with the stream or lent to a frame. Frames may outlive the stream: a
/// buffer returned after the stream's end is freed.
/// @thread thread-bound; frames may end on any thread
class StreamBuffers {
 public:
  /// Allocates the buffers and hands them to the stream.
  StreamBuffers(ArvStream* stream, std::size_t bytes_each, int buffers);
  /// Ends the use of the stream.
  ~StreamBuffers();
  StreamBuffers(const StreamBuffers&) = delete;
  StreamBuffers& operator=(const StreamBuffers&) = delete;

  [[nodiscard]] int lent() const;
  /// Lends a buffer taken from the stream.
  [[nodiscard]] FrameLease lend(ArvBuffer* buffer);
  /// Returns a buffer to the stream that was not lent.
  void return_unread(ArvBuffer* buffer);

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;  ///< shared with the frames
};

/// Makes frames from a stream's buffers, and refuses those that do not match the request.
/// @thread thread-bound
class FrameReceiver {
 public:
  /// @param stream         must outlive this object
  /// @param payload_bytes  size of a frame, including chunks
  /// @param chunks         of the camera; null if it appends none
  FrameReceiver(ArvStream* stream, const DeviceLayout& layout, const AravisCameraOptions& options,
                std::size_t payload_bytes, std::unique_ptr<ChunkReader> chunks);

  /// Prepares for frames; call it before the camera begins to acquire.
  void begin();
  /// Starts counting again.
  void restart();

  [[nodiscard]] bool all_held() const { return buffers_.lent() >= options_.frames_held_max; }

  /// Frames without the pattern come with the colours of a mosaic.
  void expect(Picture light) { light_ = light; }

  /// The evidence that a frame was exposed after the request.
  struct Proof {
    MonotonicTime asked;  ///< frames exposed earlier are stale
    const DeviceClock& clock;
    bool was_quiet = false;  ///< the camera was silent long enough that the next frame answers the command
  };

  /// Takes the stream's next completed buffer.
  /// @return nothing if the stream dropped a buffer without a frame
  /// @errors kFrameTorn, kFrameStale, kBusy; kMismatch: exposed with other settings than configured
  [[nodiscard]] Result<std::optional<Frame>> take(const Proof& proof);
  /// Takes the next buffer and returns it to the stream.
  void discard();
  /// Discards as discard() does. @return false if the frame's chunks cannot be read
  [[nodiscard]] bool discard_readable(const DeviceClock& clock);

  /// Tells whether exposure times derive from the arrival of frames.
  [[nodiscard]] bool goes_by_arrival(const DeviceClock& clock) const;
  /// Tells whether another clock than the readable one stamped the first frame.
  [[nodiscard]] bool stamps_are_foreign() const { return foreign_stamps_; }
  /// Returns all completed buffers to the stream.
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
  void judge_stamps(ArvBuffer* buffer, const FrameChunks& chunks, const DeviceClock& clock);
  void note_pace(ArvBuffer* buffer);
  [[nodiscard]] std::optional<MonotonicTime> exposure_start(ArvBuffer* buffer, const FrameChunks& chunks,
                                                            const Proof& proof) const;
  [[nodiscard]] std::optional<MonotonicTime> start_by_arrival(MonotonicTime there, const Proof& proof) const;
  [[nodiscard]] Result<std::optional<Frame>> deliver(ArvBuffer* buffer, MonotonicTime exposure_start);
  [[nodiscard]] GreyView view(ArvBuffer* buffer) const;
  [[nodiscard]] std::function<Result<ColourFrame>()> colours_later(const GreyView& mosaic) const;
  [[nodiscard]] std::optional<Frame> as_grey(ArvBuffer* buffer, MonotonicTime exposure_start);

  ArvStream* stream_;
  DeviceLayout layout_;
  Picture light_ = Picture::kPattern;
  const AravisCameraOptions& options_;
  StreamBuffers buffers_;
  std::unique_ptr<ChunkReader> chunks_;  ///< must end before the buffers
  FrameIds ids_;
  std::uint64_t underruns_ = 0;
  bool ran_out_ = false;  ///< buffers ran out; the resulting gap in the identifiers has not come yet
  MonotonicTime began_;
  bool stamps_judged_ = false;
  bool foreign_stamps_ = false;
  std::optional<std::pair<std::uint64_t, MonotonicTime>> last_;  ///< identifier and arrival of the previous frame
  bool paced_ = false;               ///< the previous frame is recent enough to measure the pace
  std::chrono::nanoseconds period_;  ///< longest recent frame period
  AravisStatistics counted_;
  std::optional<FramePool> greys_;  ///< holds grey from mosaics, and unpacked pixels
  Grey8 grey8_;
  Grey16 grey16_;
  std::vector<std::uint32_t> sums_;
};

}  // namespace slsd
