// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// The part of DoubleDevice that streams.
#include <algorithm>
#include <cerrno>
#include <cstring>

#include "tests/doubles/v4l2/double_device.hpp"
#include "tests/doubles/v4l2/encode_frame.hpp"
#include "tests/doubles/v4l2/numbered_frame.hpp"

namespace slsd::test {
namespace {

using std::chrono::steady_clock;

constexpr std::size_t kPageBytes = 4096;

std::size_t whole_pages(std::size_t bytes) {
  return (bytes + kPageBytes - 1) / kPageBytes * kPageBytes;
}

timeval time_of(MonotonicTime time) {
  const auto since = std::chrono::duration_cast<std::chrono::microseconds>(time.time_since_epoch());
  return {since / std::chrono::seconds(1), (since % std::chrono::seconds(1)).count()};
}

}  // namespace

std::size_t DoubleDevice::frame_bytes() const {
  return frame_bytes_of(fourcc_, size_.first, size_.second, options_.padding_bytes);
}

// A range is used again only when its descriptor and every mapping of it are gone: a frame that is held stays as it is.
std::shared_ptr<DoubleDevice::Range> DoubleDevice::take_range(Owner owner, std::size_t bytes) {
  std::uint64_t end = 0;
  for (const auto& range : ranges_) {
    end = std::max(end, range->offset + range->content.size());
    if (range->owner != nullptr || range->content.size() != bytes) continue;
    range->owner = owner;
    return range;
  }
  ranges_.push_back(std::make_shared<Range>(Range{end, std::vector<std::byte>(bytes), owner}));
  return ranges_.back();
}

int DoubleDevice::request_buffers(Owner owner, v4l2_requestbuffers& request) {
  if (request.type != V4L2_BUF_TYPE_VIDEO_CAPTURE || request.memory != V4L2_MEMORY_MMAP) return EINVAL;
  if ((owner_ != nullptr && owner_ != owner) || streaming_) return EBUSY;
  request.count = std::min<__u32>(request.count, static_cast<__u32>(options_.buffers_max));
  request.capabilities = V4L2_BUF_CAP_SUPPORTS_MMAP | V4L2_BUF_CAP_SUPPORTS_ORPHANED_BUFS;
  buffers_.clear();
  queued_.clear();
  done_.clear();
  for (std::size_t i = 0; i < request.count; ++i)
    buffers_.push_back({take_range(owner, whole_pages(frame_bytes())), State::kDequeued, {}});
  owner_ = buffers_.empty() ? nullptr : owner;
  return 0;
}

int DoubleDevice::describe_buffer(v4l2_buffer& buffer) const {
  if (buffer.index >= buffers_.size()) return EINVAL;
  const Buffer& described = buffers_[buffer.index];
  buffer.length = static_cast<__u32>(described.range->content.size());
  buffer.m.offset = static_cast<__u32>(described.range->offset);
  return 0;
}

int DoubleDevice::queue(Owner owner, v4l2_buffer& buffer) {
  if (owner != owner_) return EBUSY;
  if (buffer.index >= buffers_.size() || buffers_[buffer.index].state != State::kDequeued) return EINVAL;
  buffers_[buffer.index].state = State::kQueued;
  queued_.push_back(buffer.index);
  changed_.notify_all();
  return 0;
}

int DoubleDevice::dequeue(Owner owner, v4l2_buffer& buffer) {
  if (owner != owner_ || !streaming_) return EINVAL;
  if (faults_.fail_dequeue > 0) {
    --faults_.fail_dequeue;
    return EIO;
  }
  if (done_.empty()) return EAGAIN;
  Buffer& filled = buffers_[done_.front()];
  done_.pop_front();
  filled.state = State::kDequeued;
  buffer = filled.filled;
  return 0;
}

int DoubleDevice::start(Owner owner) {
  if (owner != owner_ || buffers_.empty()) return EINVAL;
  streaming_ = true;
  ++stream_;
  sequence_ = 0;
  triggers_ = 0;
  changed_.notify_all();
  return 0;
}

int DoubleDevice::stop(Owner owner) {
  if (owner_ != nullptr && owner != owner_) return EBUSY;
  end_stream();
  return 0;
}

void DoubleDevice::end_stream() {
  streaming_ = false;
  faults_.dead = false;
  queued_.clear();
  done_.clear();
  for (Buffer& buffer : buffers_) buffer.state = State::kDequeued;
  changed_.notify_all();
}

void DoubleDevice::run(const std::stop_token& stop) {
  Grey8 image;
  std::vector<std::byte> bytes;
  MonotonicTime due{};  // so that waking late now and then makes the rate no lower
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested() && present_) {
    if (const MonotonicTime until = faults_.stalled_until; until > steady_clock::now()) {
      changed_.wait_until(lock, stop, until, [&] { return !present_ || faults_.stalled_until != until; });
      continue;
    }
    changed_.wait(lock, stop, [this] { return !present_ || is_stalled() || may_expose(); });
    if (stop.stop_requested() || !present_ || is_stalled()) continue;
    const Exposure exposure = begin_exposure();
    const auto period =
        std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(1 / rate_hz_));
    const auto [width, height] = size_;
    const std::uint32_t fourcc = fourcc_;
    const int padding = options_.padding_bytes;
    const FrameSource source = options_.source ? options_.source : numbered_frame;
    const MonotonicTime arrival = exposure.start + options_.exposure + options_.readout;
    const bool in_time = exposure.start >= due && exposure.start - due < period;
    due = (in_time ? due : exposure.start) + period;
    const MonotonicTime next = options_.triggered ? arrival : due;
    lock.unlock();
    if (image.width() != width || image.height() != height) image = Grey8(width, height);
    source(exposure.number, image);
    bytes.resize(frame_bytes_of(fourcc, width, height, padding));
    const std::size_t used = encode_frame(image, fourcc, padding, bytes);
    lock.lock();
    wait_until(lock, stop, arrival);
    lock.unlock();
    finish_exposure(exposure, std::span(bytes).first(used));
    lock.lock();
    wait_until(lock, stop, next);
  }
}

void DoubleDevice::wait_until(std::unique_lock<std::mutex>& lock, const std::stop_token& stop, MonotonicTime time) {
  const unsigned stream = stream_;
  changed_.wait_until(lock, stop, time, [&] { return stream != stream_ || !present_; });
}

bool DoubleDevice::is_stalled() const {
  return faults_.stalled_until > steady_clock::now();
}

bool DoubleDevice::may_expose() const {
  if (!streaming_ || faults_.dead) return false;
  if (options_.triggered) return triggers_ > 0;
  return !options_.waits_for_buffer || !queued_.empty();
}

DoubleDevice::Exposure DoubleDevice::begin_exposure() {
  if (triggers_ > 0) --triggers_;
  return {steady_clock::now(), numbers_++, stream_};
}

void DoubleDevice::finish_exposure(const Exposure& exposure, std::span<const std::byte> bytes) {
  std::unique_lock lock(mutex_);
  if (!streaming_ || faults_.dead || stream_ != exposure.stream) return;
  if (faults_.drop > 0 || queued_.empty()) {
    faults_.drop = std::max(faults_.drop - 1, 0);
    ++sequence_;
    return;
  }
  const std::size_t index = queued_.front();
  queued_.pop_front();
  const std::shared_ptr<Range> range = buffers_[index].range;
  const v4l2_buffer filled = fill(buffers_[index], exposure, bytes);
  lock.unlock();  // a reader of the page would else wait for read(), and read() for this
  hooks_.store(range->offset, range->content);
  lock.lock();
  if (!streaming_ || stream_ != exposure.stream) return;
  buffers_[index].filled = filled;
  buffers_[index].state = State::kDone;
  done_.push_back(index);
  lock.unlock();
  hooks_.changed();
}

v4l2_buffer DoubleDevice::fill(Buffer& buffer, const Exposure& exposure, std::span<const std::byte> bytes) {
  const auto count_down = [](int& left) { return left > 0 && left-- > 0; };
  std::vector<std::byte>& content = buffer.range->content;
  v4l2_buffer filled{};
  filled.index = static_cast<__u32>(&buffer - buffers_.data());
  filled.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  filled.memory = V4L2_MEMORY_MMAP;
  filled.length = static_cast<__u32>(content.size());
  filled.m.offset = static_cast<__u32>(buffer.range->offset);
  filled.sequence = sequence_++;
  filled.flags = V4L2_BUF_FLAG_MAPPED | options_.stamp_flags | (count_down(faults_.flag) ? V4L2_BUF_FLAG_ERROR : 0);
  const bool at_start = (options_.stamp_flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  MonotonicTime stamp = exposure.start;
  if (!at_start) stamp += options_.exposure + options_.readout;
  if (count_down(faults_.age)) stamp -= faults_.age_by;
  stamp += options_.stamp_offset;
  filled.timestamp = time_of(stamp);
  const std::size_t used = count_down(faults_.shorten) ? bytes.size() / 2 : bytes.size();
  std::copy_n(bytes.begin(), used, content.begin());
  filled.bytesused = static_cast<__u32>(used);
  return filled;
}

}  // namespace slsd::test
