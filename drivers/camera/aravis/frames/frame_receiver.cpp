// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/frames/frame_receiver.hpp"

#include <algorithm>
#include <chrono>
#include <memory>
#include <mutex>
#include <utility>
#include <variant>

#include "drivers/camera/aravis/aravis_camera_options.hpp"
#include "drivers/files/bayer.hpp"
#include "drivers/files/grey_image.hpp"

namespace slsd {
namespace {

using std::chrono::nanoseconds;

constexpr std::uint64_t kHandOverUs = 100'000;
constexpr int kSpareBuffers = 4;           // being filled, or complete and not yet taken
constexpr std::uint64_t kNear = 3;         // frames, of which some may be lost
constexpr double kLeastOfExposure = 0.95;  // sensors expose slightly shorter than they report

/// The time of the frame's last byte; noted by the stream's callback.
MonotonicTime received(ArvBuffer* buffer) {
  return MonotonicTime(nanoseconds(arv_buffer_get_system_timestamp(buffer)));
}

/// The start of the frame's exposure, by the camera's clock.
nanoseconds stamp_of(ArvBuffer* buffer, const FrameChunks& chunks) {
  return chunks.exposure_start.value_or(nanoseconds(arv_buffer_get_timestamp(buffer)));
}

std::string status_text(ArvBufferStatus status) {
  switch (status) {
    case ARV_BUFFER_STATUS_TIMEOUT:
    case ARV_BUFFER_STATUS_MISSING_PACKETS:
      return "packets are missing";
    case ARV_BUFFER_STATUS_WRONG_PACKET_ID:
      return "a packet has a number of another frame";
    case ARV_BUFFER_STATUS_SIZE_MISMATCH:
      return "it is larger than a frame";
    default:
      return "the stream aborted it";
  }
}

}  // namespace

/// Shared with the frames that hold a buffer; the stream ends before them.
struct StreamBuffers::Shared final : LentBuffers {
  Shared(ArvStream* of, std::size_t count) : LentBuffers(count), stream(of), buffers(count) {}

  void give_back(ArvBuffer* buffer) {
    const std::lock_guard lock(mutex);
    if (stream != nullptr)
      arv_stream_push_buffer(stream, buffer);
    else
      g_object_unref(buffer);
  }
  void take_back(std::size_t buffer) override { give_back(buffers[buffer]); }

  std::mutex mutex;
  ArvStream* stream;
  std::vector<ArvBuffer*> buffers;
};

StreamBuffers::StreamBuffers(ArvStream* stream, std::size_t bytes_each, int buffers)
    : shared_(std::make_shared<Shared>(stream, static_cast<std::size_t>(buffers))) {
  for (std::size_t i = 0; i < shared_->size(); ++i) {
    shared_->buffers[i] = arv_buffer_new_full(bytes_each, nullptr, GSIZE_TO_POINTER(i), nullptr);
    arv_stream_push_buffer(stream, shared_->buffers[i]);
  }
}

StreamBuffers::~StreamBuffers() {
  const std::lock_guard lock(shared_->mutex);
  shared_->stream = nullptr;
}

int StreamBuffers::lent() const {
  return static_cast<int>(shared_->lent());
}

FrameLease StreamBuffers::lend(ArvBuffer* buffer) {
  return shared_->lend(GPOINTER_TO_SIZE(arv_buffer_get_user_data(buffer)));
}

void StreamBuffers::return_unread(ArvBuffer* buffer) {
  shared_->give_back(buffer);
}

FrameReceiver::FrameReceiver(ArvStream* stream, const DeviceLayout& layout, const AravisCameraOptions& options,
                             std::size_t payload_bytes, std::unique_ptr<ChunkReader> chunks)
    : stream_(stream),
      layout_(layout),
      options_(options),
      buffers_(stream, payload_bytes, options.frames_held_max + kSpareBuffers),
      chunks_(std::move(chunks)),
      period_(layout.period) {
  if (layout.pixels.is_zero_copy()) return;
  greys_.emplace(FrameFormat{layout.width_px, layout.height_px, layout.pixels.bytes_per_pixel},
                 options.frames_held_max);
  sums_.resize(static_cast<std::size_t>(layout.width_px));
  if (layout.pixels.bytes_per_pixel == 1)
    grey8_ = Grey8(layout.width_px, layout.height_px);
  else
    grey16_ = Grey16(layout.width_px, layout.height_px);
}

void FrameReceiver::begin() {
  restart();
  began_ = std::chrono::steady_clock::now();
}

void FrameReceiver::restart() {
  ids_.forget();
  ran_out_ = false;
  counted_ = {};
}

// The stream reports a buffer before it hands it over, so this waits for it. Otherwise the buffer would be taken for
// the next frame, and so would each later one. For a packet without a frame, the stream hands over an untouched buffer,
// without a report.
ArvBuffer* FrameReceiver::pop() {
  for (;;) {
    ArvBuffer* buffer = arv_stream_timeout_pop_buffer(stream_, kHandOverUs);
    if (buffer == nullptr || arv_buffer_get_status(buffer) != ARV_BUFFER_STATUS_CLEARED) return buffer;
    buffers_.return_unread(buffer);
  }
}

void FrameReceiver::return_unread(ArvBuffer* buffer) {
  if (arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS) {
    note_identifier(buffer);
    note_pace(buffer);
  }
  buffers_.return_unread(buffer);
}

void FrameReceiver::discard() {
  if (ArvBuffer* buffer = pop()) return_unread(buffer);
}

// A frame is too large for its buffer if it has more chunks than the camera reported.
bool FrameReceiver::discard_readable(const DeviceClock& clock) {
  ArvBuffer* buffer = pop();
  if (buffer == nullptr) return true;
  const bool too_large = arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SIZE_MISMATCH;
  const bool whole = wrong_with(buffer).empty();
  const auto chunks = whole ? read_chunks(buffer) : std::nullopt;
  if (chunks) judge_stamps(buffer, *chunks, clock);
  return_unread(buffer);
  return !chunks_ || (whole ? chunks.has_value() : !too_large);
}

void FrameReceiver::discard_all() {
  while (ArvBuffer* buffer = arv_stream_try_pop_buffer(stream_)) return_unread(buffer);
}

Result<std::optional<Frame>> FrameReceiver::take(const Proof& proof) {
  ArvBuffer* buffer = pop();
  if (buffer == nullptr) return std::nullopt;
  if (const std::string wrong = wrong_with(buffer); !wrong.empty())
    return refuse(buffer, counted_.torn, ErrorCode::kFrameTorn, "the frame is incomplete: " + wrong);
  const auto chunks = read_chunks(buffer);
  if (!chunks)
    return refuse(buffer, counted_.torn, ErrorCode::kFrameTorn,
                  "the frame is incomplete: its chunks do not match the camera's description; if this happens with "
                  "every frame, set chunks = false");
  note_identifier(buffer);
  note_pace(buffer);
  judge_stamps(buffer, *chunks, proof.clock);
  if (const std::string unlike = unlike_configured(*chunks, options_); !unlike.empty())
    return refuse(
        buffer, counted_.misexposed, ErrorCode::kMismatch,
        "the frame was exposed with other settings: " + unlike +
            "; scan again; if this persists, check that no other program sets the camera, or set chunks = false");
  const auto start = exposure_start(buffer, *chunks, proof);
  if (start) return deliver(buffer, *start);
  return refuse(buffer, counted_.stale, ErrorCode::kFrameStale, "the frame was exposed before it was requested");
}

tl::unexpected<Error> FrameReceiver::refuse(ArvBuffer* buffer, std::uint64_t& count, ErrorCode code,
                                            std::string message) {
  buffers_.return_unread(buffer);
  ++count;
  return fail(code, std::move(message), options_.name);
}

std::optional<FrameChunks> FrameReceiver::read_chunks(ArvBuffer* buffer) {
  return chunks_ ? chunks_->read(buffer) : FrameChunks{};
}

// Check the status first: a failed buffer keeps the pixels, and often the size, of an earlier frame. A frame that ends
// too early still counts as a success.
std::string FrameReceiver::wrong_with(ArvBuffer* buffer) const {
  const ArvBufferStatus status = arv_buffer_get_status(buffer);
  if (status != ARV_BUFFER_STATUS_SUCCESS) return status_text(status);
  const ArvBufferPayloadType payload = arv_buffer_get_payload_type(buffer);
  const bool extended = chunks_ && payload == ARV_BUFFER_PAYLOAD_TYPE_EXTENDED_CHUNK_DATA;
  if (payload != ARV_BUFFER_PAYLOAD_TYPE_IMAGE && !extended) return "it is not an image";
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
  return same && x_padding == 0 ? "" : "its size or pixel format differs from the configured one";
}

// If the stream ran out of buffers, nobody requested the missing frames. They are missing after those that filled the
// buffers.
void FrameReceiver::note_identifier(ArvBuffer* buffer) {
  guint64 underruns = 0;
  arv_stream_get_statistics(stream_, nullptr, nullptr, &underruns);
  if (std::exchange(underruns_, underruns) != underruns) ran_out_ = true;
  const std::uint64_t missing = ids_.note(arv_buffer_get_frame_id(buffer));
  if (missing > 0 && !std::exchange(ran_out_, false)) counted_.lost += missing;
}

// No exposure can begin before the camera started to acquire, nor after the frame arrived. Such a stamp comes from
// another clock than the readable one. The first frame decides, before anything depends on it.
void FrameReceiver::judge_stamps(ArvBuffer* buffer, const FrameChunks& chunks, const DeviceClock& clock) {
  if (stamps_judged_ || options_.device_clock != AravisClock::kAuto || options_.ptp || !clock.ready()) return;
  stamps_judged_ = true;
  foreign_stamps_ = !clock.may_have_shown(stamp_of(buffer, chunks), began_, received(buffer));
}

// The longest recent period. A slow link makes it longer than the camera reports, and delayed frames come in a burst.
// If frames in between found no buffer, their pace is unknown.
void FrameReceiver::note_pace(ArvBuffer* buffer) {
  const std::uint64_t id = arv_buffer_get_frame_id(buffer);
  const MonotonicTime there = received(buffer);
  const auto before = std::exchange(last_, std::pair(id, there));
  paced_ = before && id > before->first && id - before->first <= kNear;
  if (paced_) period_ = std::max({layout_.period, there - before->second, period_ * 9 / 10});
}

bool FrameReceiver::goes_by_arrival(const DeviceClock& clock) const {
  return options_.device_clock == AravisClock::kArrival || foreign_stamps_ || !clock.ready();
}

std::optional<MonotonicTime> FrameReceiver::exposure_start(ArvBuffer* buffer, const FrameChunks& chunks,
                                                           const Proof& proof) const {
  const MonotonicTime there = received(buffer);
  if (goes_by_arrival(proof.clock)) return start_by_arrival(there, proof);
  const nanoseconds device = stamp_of(buffer, chunks);
  const MonotonicTime start = proof.clock.host_time(device);
  // A frame that answers our command cannot be older. A line or the camera's own clock begins frames at any time:
  // frames that may have begun earlier are skipped.
  const bool commanded = options_.trigger == AravisTrigger::kSoftware || options_.trigger == AravisTrigger::kAction;
  const nanoseconds uncertain = proof.clock.uncertainty(device);
  if (start + (commanded ? uncertain : -uncertain) < proof.asked) return std::nullopt;
  if (!proof.clock.may_have_shown(device, there)) return std::nullopt;
  return std::clamp(start, std::min(proof.asked, there), there);
}

// With a command, exactly one frame is due, and all earlier ones have come. A frame that comes sooner than an exposure
// takes does not answer the command, unless the camera was silent for longer than any frame took. Without a command,
// frames follow each other. Each was exposed, read out within one period and sent within another; otherwise they would
// pile up. So the reported start is the earliest possible one. A frame that may have begun before the request is
// skipped.
std::optional<MonotonicTime> FrameReceiver::start_by_arrival(MonotonicTime there, const Proof& proof) const {
  if (options_.trigger == AravisTrigger::kSoftware) {
    const bool took_its_time = there - proof.asked >= from_us(options_.exposure_us * kLeastOfExposure);
    return took_its_time || proof.was_quiet ? std::optional(proof.asked) : std::nullopt;
  }
  const bool runs = options_.trigger == AravisTrigger::kFreeRun;
  if (runs && !paced_) return std::nullopt;
  const nanoseconds period = runs ? period_ : layout_.period;
  const nanoseconds readout = options_.readout_us > 0.0 ? from_us(options_.readout_us) : 2 * period;
  const MonotonicTime start = there - from_us(options_.exposure_us) - readout;
  return start < proof.asked ? std::nullopt : std::optional(start);
}

Result<std::optional<Frame>> FrameReceiver::deliver(ArvBuffer* buffer, MonotonicTime start) {
  const MonotonicTime there = received(buffer);
  const std::uint64_t sequence = counted_.delivered + counted_.lost;
  if (!greys_) {
    ++counted_.delivered;
    return std::make_optional<Frame>(view(buffer), sequence, start, there, buffers_.lend(buffer));
  }
  auto grey = as_grey(buffer, start);
  if (grey && layout_.pixels.mosaic && light_ != Picture::kPattern)
    grey = std::move(*grey).with_colours(colours_later(view(buffer)));
  buffers_.return_unread(buffer);
  if (!grey) return fail(ErrorCode::kBusy, "all frames are held; release some first", options_.name);
  ++counted_.delivered;
  return std::move(*grey).restamped(start, there);
}

std::function<Result<ColourFrame>()> FrameReceiver::colours_later(const GreyView& mosaic) const {
  return [copy = std::make_shared<const GreyImage>(copy_of(mosaic)), bayer = layout_.pixels.bayer()]() {
    return Result<ColourFrame>(colours_from_mosaic(slsd::view(*copy), bayer));
  };
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

std::optional<Frame> FrameReceiver::as_grey(ArvBuffer* buffer, MonotonicTime start) {
  const std::uint64_t sequence = counted_.delivered + counted_.lost;
  if (layout_.pixels.packing != PixelPacking::kNone) {
    std::size_t bytes = 0;
    const void* packed = arv_buffer_get_image_data(buffer, &bytes);
    unpack_pixels({static_cast<const std::uint8_t*>(packed), bytes}, layout_.pixels.packing, grey16_);
    return greys_->lend(grey16_.view(), sequence, start);
  }
  const GreyView mosaic = view(buffer);
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
  arv_stream_get_statistics(stream_, nullptr, nullptr, &statistics.underruns);
  return statistics;
}

}  // namespace slsd
