// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/v4l2/v4l2_camera.hpp"
#include "drivers/camera/v4l2/read_colours.hpp"

#include <linux/videodev2.h>

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "core/printable.hpp"
#include "drivers/camera/v4l2/v4l2_controls.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

constexpr int kBuffersBesideHeld = 3;  // being filled, waiting, or returning
constexpr int kFaultsInARowMax = 8;
constexpr int kStaleToTell = 3;  // more stale frames than can be in flight
constexpr std::uint32_t kHalfOfAllSequences = 1u << 31;
constexpr std::size_t kQueuedWhileIdle = 3;  // some drivers need this many to run at all
constexpr auto kFirstFrameLeast = 3s;        // many USB cameras take a second
constexpr auto kFirstFrameMost = 10s;        // slower cameras are refused

/// A camera's name under /dev/v4l/by-id, with maker, model and serial number. Many USB Video Class cameras have no
/// serial number; then another of the same model looks identical.
std::string hardware_of(const std::string& device) {
  const auto link = find_stable_link(device, "/dev");
  return link ? printable(link->filename().string()) : std::string();
}

}  // namespace

V4l2Camera::V4l2Camera(V4l2CameraOptions options)
    : options_(std::move(options)), description_{options_.name, "v4l2", options_.device_path().string(), 0, 0} {}

void V4l2Camera::close() {
  converter_.reset();
  stream_.reset();
  last_start_.reset();
}

Result<> V4l2Camera::open() {
  close();
  pool_.reset();
  wake_.reset();
  if (auto valid = options_.validate(); !valid) return valid;
  if (auto wake = wake_.open(); !wake) return wake;
  auto device = V4l2Device::open(description_.device);
  if (!device) return tl::unexpected(device.error());
  if (found_) found_();
  return configure(std::move(*device));
}

Result<> V4l2Camera::configure(V4l2Device device) {
  const auto mode = choose_mode(list_modes(device, options_), options_);
  if (!mode) return tl::unexpected(mode.error());
  const auto layout = set_mode(device, *mode);
  if (!layout) return tl::unexpected(layout.error());
  if (auto set = set_frame_rate(device, options_); !set) return set;
  if (auto set = set_controls(device, options_); !set) return set;
  layout_ = *layout;
  const ExposureTiming timing = read_timing(device);
  clock_ = ExposureClock(timing, options_, device.driver());
  description_.rate_hz = timing.period ? std::chrono::seconds(1) / std::chrono::duration<double>(*timing.period) : 0.0;
  const bool zero_copy = is_zero_copy(mode->format.layout);
  if (!zero_copy) {
    pool_.emplace(FrameFormat{mode->width_px, mode->height_px, bytes_per_pixel(mode->format.layout)},
                  options_.frames_held_max);
    converter_.emplace(layout_);
  }
  auto stream = V4l2Stream::start(std::move(device), kBuffersBesideHeld + (zero_copy ? options_.frames_held_max : 1));
  if (!stream) return tl::unexpected(stream.error());
  stream_.emplace(std::move(*stream));
  held_max_ = std::min<std::size_t>(options_.frames_held_max, stream_->buffers().size() - 2);
  description_.hardware = hardware_of(description_.device);
  description_.external_trigger = options_.missed_frames_max == 0;
  description_.width_px = mode->width_px;
  description_.height_px = mode->height_px;
  settling_ = options_.settle_frames;
  faults_in_a_row_ = 0;
  next_sequence_ = 0;
  last_sequence_.reset();
  return wait_for_first_frame();
}

// Otherwise a stream that starts without frames would be opened, found dead and reopened without end, and be called
// ready in between.
Result<> V4l2Camera::wait_for_first_frame() {
  const auto longest =
      std::max<std::chrono::nanoseconds>(clock_.silence_max(options_.missed_frames_max), kFirstFrameLeast);
  if (options_.missed_frames_max == 0 || longest > kFirstFrameMost) return {};
  const auto woken = wake_.wait(stream_->device().descriptor(), steady_clock::now() + longest);
  if (woken == WakeEvent::Woken::kReady) return {};
  close();
  if (woken == WakeEvent::Woken::kWoken) return fail_here(ErrorCode::kCancelled, "opening was cancelled");
  if (woken == WakeEvent::Woken::kGone) return fail_gone();
  return fail_here(ErrorCode::kTimeout,
                   "it starts but sends no frame; unplug it and plug it in again, or try another cable or port; if it "
                   "waits for a trigger, set missed_frames_max = 0");
}

Result<Frame> V4l2Camera::capture(MonotonicTime deadline) {
  return run({steady_clock::now(), deadline, clock_.frames_in_flight()});
}

// After a pause, the buffers contain the scene from its beginning.
Result<Frame> V4l2Camera::capture_next(MonotonicTime deadline) {
  if (!last_start_ || steady_clock::now() - *last_start_ > clock_.next_frame_age_max()) return capture(deadline);
  Capture next{*last_start_ + std::chrono::nanoseconds(1), deadline};
  next.next = true;
  return run(next);
}

Result<Frame> V4l2Camera::run(const Capture& capture) {
  if (!stream_) return fail_here(ErrorCode::kDisconnected, "the camera is not open; open it");
  auto frame = capture_after(capture);
  if (frame) last_start_ = frame->exposure_start();
  if (!frame && frame.error().code == ErrorCode::kDisconnected) close();
  return frame;
}

Result<> V4l2Camera::set_exposure(double exposure_us) {
  if (!stream_) return fail_here(ErrorCode::kDisconnected, "the camera is not open; open it");
  if (options_.exposure_us == exposure_us) return {};
  if (auto dropped = drop_waiting(); !dropped) return close(), dropped;
  auto set = slsd::set_exposure(stream_->device(), exposure_us);
  if (!set) {
    if (set.error().code == ErrorCode::kDisconnected) close();
    return set;
  }
  options_.exposure_us = exposure_us;
  const int under_way = clock_.frames_in_flight();
  clock_.set_exposure(read_timing(stream_->device()));
  settling_ = std::max({options_.settle_frames, under_way, clock_.frames_in_flight()});
  return {};
}

// An open file always answers; a call into the driver does not. Filled buffers prove nothing about now, and the frame
// after the last may still be requested. So only after a pause are they emptied, to see whether more come.
Result<> V4l2Camera::check() {
  if (!stream_) return fail_here(ErrorCode::kDisconnected, "the camera is not open; open it");
  v4l2_capability capability{};
  if (stream_->device().call(VIDIOC_QUERYCAP, &capability) != 0) return close(), fail_gone();
  if (last_start_ && steady_clock::now() - *last_start_ <= clock_.next_frame_age_max()) return {};
  if (auto dropped = drop_waiting(); !dropped) return close(), dropped;
  if (auto put = stream_->put_back_returned(kQueuedWhileIdle); !put) return close(), put;
  if (steady_clock::now() < dead_at()) return {};
  const auto dead = fail_dead();
  close();
  return dead;
}

Result<Frame> V4l2Camera::capture_after(Capture capture) {
  if (!pool_ && stream_->buffers().lent() >= held_max_)
    return fail_here(ErrorCode::kBusy, "all " + std::to_string(held_max_) + " frames are held; release some first");
  if (!capture.next) {
    if (auto dropped = drop_waiting(); !dropped) return tl::unexpected(dropped.error());
  }
  if (auto put = stream_->put_back_returned(); !put) return tl::unexpected(put.error());
  while (true) {
    if (auto ready = wait(capture); !ready) return tl::unexpected(ready.error());
    auto frame = take(capture);
    if (!frame) return tl::unexpected(frame.error());
    if (*frame) return std::move(**frame);
    if (steady_clock::now() > capture.deadline) return fail_late(capture);  // stale frames may come without end
  }
}

// Buffers that are already filled were exposed before the request.
Result<> V4l2Camera::drop_waiting() {
  const std::size_t had = stream_->queued();
  std::size_t taken = 0;
  for (; taken < had; ++taken) {
    const auto buffer = stream_->take();
    if (!buffer && buffer.error().code == ErrorCode::kDisconnected) return tl::unexpected(buffer.error());
    if (!buffer || !*buffer) break;
    note_stamp(**buffer, steady_clock::now());
    counts_.dropped += note_order(**buffer);
    ++counts_.before_trigger;
    settling_ = std::max(settling_ - 1, 0);
  }
  // When every buffer was full, the driver had to drop frames; nobody needed them.
  if (taken == had) last_sequence_.reset();
  return {};
}

MonotonicTime V4l2Camera::dead_at() const {
  const MonotonicTime quiet_since = stream_->quiet_since();
  if (options_.missed_frames_max == 0 || quiet_since == MonotonicTime::max()) return MonotonicTime::max();
  return quiet_since + clock_.silence_max(options_.missed_frames_max);
}

tl::unexpected<Error> V4l2Camera::fail_dead() const {
  const auto silence =
      std::chrono::duration_cast<std::chrono::milliseconds>(steady_clock::now() - stream_->quiet_since());
  return fail_here(ErrorCode::kDisconnected, "no frame arrived for " + std::to_string(silence.count()) +
                                                 " ms, so slsd restarts its stream; check its cable if this happens "
                                                 "again; if it waits for a trigger, set missed_frames_max = 0");
}

tl::unexpected<Error> V4l2Camera::fail_gone() const {
  return fail_here(ErrorCode::kDisconnected, "the camera is gone; check its cable");
}

Result<> V4l2Camera::wait(const Capture& capture) {
  const MonotonicTime dead_at = this->dead_at();
  switch (wake_.wait(stream_->device().descriptor(), std::min(capture.deadline, dead_at))) {
    case WakeEvent::Woken::kWoken:
      return fail_here(ErrorCode::kCancelled, "the capture was cancelled");
    case WakeEvent::Woken::kGone:
      return fail_gone();
    case WakeEvent::Woken::kLate:
      return steady_clock::now() < dead_at ? fail_late(capture) : fail_dead();
    case WakeEvent::Woken::kReady:
      break;
  }
  return {};
}

tl::unexpected<Error> V4l2Camera::fail_late(const Capture& capture) const {
  if (capture.stale < kStaleToTell)
    return fail_here(ErrorCode::kFrameLate,
                     "no frame arrived before the deadline; allow more time or raise the frame rate");
  return fail_here(ErrorCode::kFrameStale, std::to_string(capture.stale) +
                                               " frames arrived, all exposed before the trigger by their time stamps; "
                                               "scan again, then unplug the camera and plug it in again");
}

Result<std::optional<Frame>> V4l2Camera::take(Capture& capture) {
  const auto buffer = stream_->take();
  if (!buffer && buffer.error().code == ErrorCode::kDisconnected) return tl::unexpected(buffer.error());
  if (!buffer && ++faults_in_a_row_ >= kFaultsInARowMax)
    return fail_here(ErrorCode::kDisconnected, "the driver keeps reporting faults; slsd reopens the camera");
  if (!buffer) {
    ++counts_.dropped;
    return lose(ErrorCode::kFrameDropped, 1, buffer.error().message);
  }
  if (!*buffer) return std::nullopt;
  faults_in_a_row_ = 0;
  auto frame = judge(**buffer, capture);
  if (frame && *frame && !pool_) return frame;
  if (auto put = stream_->put_back((*buffer)->index); !put) return tl::unexpected(put.error());
  return frame;
}

Result<std::optional<Frame>> V4l2Camera::judge(const v4l2_buffer& buffer, Capture& capture) {
  const MonotonicTime received = steady_clock::now();
  note_stamp(buffer, received);
  const MonotonicTime exposure_start = this->exposure_start(buffer, received, capture);
  const std::uint32_t lost = note_order(buffer);
  counts_.dropped += lost;
  if (settling_ > 0 || exposure_start < capture.trigger) {
    if (settling_ > 0)
      --settling_;
    else
      ++capture.stale;
    ++counts_.before_trigger;
    return std::nullopt;
  }
  if (lost > 0 && capture.next) next_sequence_ += lost;
  if (lost > 0 && !capture.next)  // one of them may be the requested frame
    return lose(ErrorCode::kFrameDropped, lost, std::to_string(lost) + " frames were lost in transit; scan again");
  if (!is_whole(buffer)) {
    ++counts_.torn;
    return lose(ErrorCode::kFrameTorn, 1, "only part of the frame arrived; scan again");
  }
  if (received > capture.deadline)
    return fail_here(ErrorCode::kFrameLate, "the frame came after the deadline; allow more time");
  auto frame = deliver(buffer, exposure_start, received);
  if (!frame) return tl::unexpected(frame.error());
  return std::move(*frame);
}

MonotonicTime V4l2Camera::exposure_start(const v4l2_buffer& buffer, MonotonicTime received, Capture& capture) const {
  const MonotonicTime start = clock_.exposure_start(buffer, received);
  if (clock_.is_stamped(buffer)) return start;
  if (capture.in_flight == 0) return std::max(start, capture.trigger);
  --capture.in_flight;
  return std::min(start, capture.trigger - std::chrono::nanoseconds(1));
}

void V4l2Camera::note_stamp(const v4l2_buffer& buffer, MonotonicTime received) {
  clock_.note(buffer, received);
  if (clock_.is_trusted() || std::exchange(clock_warned_, true)) return;
  spdlog::warn(
      "camera {}: time_stamps: its driver does not stamp frames by the monotonic clock; slsd goes by their order "
      "instead, and a scan may wait for one more",
      options_.name);
}

std::uint32_t V4l2Camera::note_order(const v4l2_buffer& buffer) {
  const auto last = std::exchange(last_sequence_, buffer.sequence);
  if (!last) return 0;
  const std::uint32_t missing = buffer.sequence - *last - 1;
  return missing < kHalfOfAllSequences ? missing : 0;  // else the device restarted its count, or has none
}

bool V4l2Camera::is_whole(const v4l2_buffer& buffer) const {
  if ((buffer.flags & V4L2_BUF_FLAG_ERROR) != 0) return false;
  return buffer.bytesused >= layout_.bytes_min && buffer.bytesused <= stream_->buffers().bytes(buffer.index).size();
}

Result<Frame> V4l2Camera::deliver(const v4l2_buffer& buffer, MonotonicTime exposure_start, MonotonicTime received) {
  if (pool_) return convert(buffer, exposure_start, received);
  ++counts_.delivered;
  const auto bytes = stream_->buffers().bytes(buffer.index);
  Frame frame(view_of(bytes, layout_), next_sequence_++, exposure_start, received, stream_->lend(buffer.index));
  if (light_ == Picture::kPattern) return frame;
  return std::move(frame).with_colours(colours_later(bytes.first(buffer.bytesused), layout_));
}

Result<Frame> V4l2Camera::convert(const v4l2_buffer& buffer, MonotonicTime exposure_start, MonotonicTime received) {
  const auto bytes = stream_->buffers().bytes(buffer.index).first(buffer.bytesused);
  const auto grey = converter_->convert(bytes);
  if (!grey) {
    ++counts_.torn;
    return lose(grey.error().code, 1, grey.error().message);
  }
  auto frame = pool_->lend(*grey, next_sequence_, exposure_start);
  if (!frame)
    return fail_here(ErrorCode::kBusy,
                     "all " + std::to_string(options_.frames_held_max) + " frames are held; release some first");
  ++next_sequence_;
  ++counts_.delivered;
  Frame stamped = std::move(*frame).restamped(exposure_start, received);
  if (light_ == Picture::kPattern) return stamped;
  return std::move(stamped).with_colours(colours_later(bytes, layout_));
}

void V4l2Camera::tell_figures(std::vector<DriverFigure>& figures) const {
  figures.push_back({"frames_before_trigger", static_cast<double>(counts_.before_trigger)});
  figures.push_back({"frames_dropped", static_cast<double>(counts_.dropped)});
  figures.push_back({"frames_torn", static_cast<double>(counts_.torn)});
}

tl::unexpected<Error> V4l2Camera::lose(ErrorCode code, std::uint64_t frames, std::string message) {
  next_sequence_ += frames;
  return fail_here(code, std::move(message));
}

tl::unexpected<Error> V4l2Camera::fail_here(ErrorCode code, std::string message) const {
  return fail(code, std::move(message), options_.name);
}

}  // namespace slsd
