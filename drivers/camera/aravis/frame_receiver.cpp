// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/frame_receiver.hpp"

#include <algorithm>
#include <chrono>
#include <utility>
#include <variant>

#include "drivers/files/bayer.hpp"

namespace slsd {
namespace {

using std::chrono::nanoseconds;

constexpr int kSpareBuffers = 4;  // being filled, or done and not yet taken

nanoseconds from_us(double microseconds) {
  return std::chrono::duration_cast<nanoseconds>(std::chrono::duration<double, std::micro>(microseconds));
}

/// When its last byte came; noted by the stream's callback.
MonotonicTime received(ArvBuffer* buffer) {
  return MonotonicTime(nanoseconds(arv_buffer_get_system_timestamp(buffer)));
}

std::string status_text(ArvBufferStatus status) {
  switch (status) {
    case ARV_BUFFER_STATUS_TIMEOUT:
    case ARV_BUFFER_STATUS_MISSING_PACKETS:
      return "packets are missing";
    case ARV_BUFFER_STATUS_WRONG_PACKET_ID:
      return "a packet has a number that is not of this frame";
    case ARV_BUFFER_STATUS_SIZE_MISMATCH:
      return "it is larger than a frame";
    default:
      return "the stream gave it up";
  }
}

}  // namespace

FrameReceiver::FrameReceiver(ArvStream* stream, const DeviceLayout& layout, const AravisCameraOptions& options)
    : stream_(stream),
      layout_(layout),
      options_(options),
      buffers_(stream, layout.bytes(), options.frames_held_max + kSpareBuffers) {
  if (!layout.pixels.mosaic) return;
  greys_.emplace(FrameFormat{layout.width_px, layout.height_px, layout.pixels.bytes_per_pixel},
                 options.frames_held_max);
  sums_.resize(static_cast<std::size_t>(layout.width_px));
  if (layout.pixels.bytes_per_pixel == 1)
    grey8_ = Grey8(layout.width_px, layout.height_px);
  else
    grey16_ = Grey16(layout.width_px, layout.height_px);
}

void FrameReceiver::restart() {
  ids_.forget();
  counted_ = {};
}

void FrameReceiver::discard() {
  if (ArvBuffer* buffer = arv_stream_try_pop_buffer(stream_)) {
    if (arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS) note_identifier(buffer);
    buffers_.return_unread(buffer);
  }
}

Result<std::optional<Frame>> FrameReceiver::take(MonotonicTime asked, const DeviceClock& clock) {
  ArvBuffer* buffer = arv_stream_try_pop_buffer(stream_);
  if (buffer == nullptr) return std::nullopt;
  if (const std::string wrong = wrong_with(buffer); !wrong.empty()) {
    buffers_.return_unread(buffer);
    ++counted_.torn;
    return fail(ErrorCode::kFrameTorn, "the frame is not whole: " + wrong, options_.name);
  }
  note_identifier(buffer);
  const auto start = exposure_start(buffer, asked, clock);
  if (start) return deliver(buffer, *start);
  buffers_.return_unread(buffer);
  ++counted_.stale;
  return fail(ErrorCode::kFrameStale, "the frame was exposed before it was asked for", options_.name);
}

// The status first: what failed keeps the pixels, and often the size, of the frame before. A frame that ends too early
// still counts as a success.
std::string FrameReceiver::wrong_with(ArvBuffer* buffer) const {
  const ArvBufferStatus status = arv_buffer_get_status(buffer);
  if (status != ARV_BUFFER_STATUS_SUCCESS) return status_text(status);
  if (arv_buffer_get_payload_type(buffer) != ARV_BUFFER_PAYLOAD_TYPE_IMAGE) return "it is no image";
  std::size_t bytes = 0;
  arv_buffer_get_image_data(buffer, &bytes);
  if (bytes < layout_.bytes())
    return "it has " + std::to_string(bytes) + " of " + std::to_string(layout_.bytes()) + " bytes";
  const bool same = arv_buffer_get_image_width(buffer) == layout_.width_px &&
                    arv_buffer_get_image_height(buffer) == layout_.height_px &&
                    arv_buffer_get_image_pixel_format(buffer) == layout_.pixels.code;
  int x_padding = 0;
  int y_padding = 0;
  arv_buffer_get_image_padding(buffer, &x_padding, &y_padding);
  return same && x_padding == 0 ? "" : "its size or pixel format is not as configured";
}

// Where the stream ran out of buffers, nobody asked for the frames that are missing.
void FrameReceiver::note_identifier(ArvBuffer* buffer) {
  guint64 underruns = 0;
  arv_stream_get_statistics(stream_, nullptr, nullptr, &underruns);
  const std::uint64_t missing = ids_.note(arv_buffer_get_frame_id(buffer));
  if (std::exchange(underruns_, underruns) == underruns) counted_.lost += missing;
}

std::optional<MonotonicTime> FrameReceiver::exposure_start(ArvBuffer* buffer, MonotonicTime asked,
                                                           const DeviceClock& clock) const {
  const MonotonicTime there = received(buffer);
  if (!clock.ready()) {
    const MonotonicTime start = there - from_us(options_.exposure_us);
    if (options_.trigger == AravisTrigger::kSoftware) return asked;
    return start < asked ? std::nullopt : std::optional(start);
  }
  const nanoseconds device(arv_buffer_get_timestamp(buffer));
  const MonotonicTime start = clock.host_time(device);
  if (start + clock.uncertainty(device) < asked) return std::nullopt;
  return std::clamp(start, std::min(asked, there), there);
}

Result<std::optional<Frame>> FrameReceiver::deliver(ArvBuffer* buffer, MonotonicTime start) {
  const MonotonicTime there = received(buffer);
  const std::uint64_t sequence = counted_.delivered + counted_.lost;
  if (!greys_) {
    ++counted_.delivered;
    return std::make_optional<Frame>(view(buffer), sequence, start, there, buffers_.lend(buffer));
  }
  auto grey = as_grey(view(buffer), start);
  buffers_.return_unread(buffer);
  if (!grey) return fail(ErrorCode::kBusy, "all frames are held; give some back first", options_.name);
  ++counted_.delivered;
  return std::move(*grey).restamped(start, there);
}

GreyView FrameReceiver::view(ArvBuffer* buffer) const {
  std::size_t bytes = 0;
  const void* pixels = arv_buffer_get_image_data(buffer, &bytes);
  const int width = layout_.width_px;
  const int height = layout_.height_px;
  if (layout_.pixels.bytes_per_pixel == 1)
    return ImageView<std::uint8_t>{static_cast<const std::uint8_t*>(pixels), width, height, width};
  return ImageView<std::uint16_t>{static_cast<const std::uint16_t*>(pixels), width, height, width};
}

std::optional<Frame> FrameReceiver::as_grey(const GreyView& mosaic, MonotonicTime start) {
  const std::uint64_t sequence = counted_.delivered + counted_.lost;
  if (const auto* deep = std::get_if<ImageView<std::uint16_t>>(&mosaic)) {
    grey_from_mosaic(*deep, grey16_, sums_);
    return greys_->lend(grey16_.view(), sequence, start);
  }
  grey_from_mosaic(std::get<ImageView<std::uint8_t>>(mosaic), grey8_, sums_);
  return greys_->lend(grey8_.view(), sequence, start);
}

AravisStatistics FrameReceiver::statistics() const {
  AravisStatistics statistics = counted_;
  if (ARV_IS_GV_STREAM(stream_))
    arv_gv_stream_get_statistics(ARV_GV_STREAM(stream_), &statistics.packets_sent_again, &statistics.packets_missing);
  return statistics;
}

}  // namespace slsd
