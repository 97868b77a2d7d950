// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <linux/videodev2.h>
#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <thread>
#include <vector>

#include "drivers/camera/frame.hpp"
#include "tests/doubles/v4l2/double_controls.hpp"
#include "tests/doubles/v4l2/double_options.hpp"

namespace slsd::test {

/// What goes wrong with the next frames.
struct DoubleFaults {
  int drop = 0;          ///< frames that leave a gap in the sequence
  int flag = 0;          ///< frames that carry V4L2_BUF_FLAG_ERROR
  int shorten = 0;       ///< frames with half their bytes
  int age = 0;           ///< frames whose stamps are old, by age_by
  int fail_dequeue = 0;  ///< DQBUF calls that fail with EIO
  std::chrono::nanoseconds age_by{std::chrono::seconds(1)};
  bool dead = false;              ///< the stream brings nothing more until it ends; every call is answered as before
  MonotonicTime stalled_until{};  ///< no exposure begins before
};

/// One life of the double, from plug to unplug: the ioctls of a capture device, and a thread that exposes.
/// @thread thread-safe
class DoubleDevice {
 public:
  /// How the device reaches the file that stands for it.
  struct Hooks {
    std::function<void(std::uint64_t offset, std::span<const std::byte>)> store;  ///< into the page cache
    std::function<void()> changed;  ///< what poll() gives may have changed
  };
  using Owner = const void*;  ///< an open descriptor

  /// @param numbers  of the frames' exposures, over all lives
  DoubleDevice(const DoubleOptions& options, std::atomic<std::uint64_t>& numbers, Hooks hooks);
  ~DoubleDevice();

  /// 0 or errno. @param argument  in and out @param caller  whose memory pointers in it mean
  [[nodiscard]] int ioctl(Owner owner, unsigned command, void* argument, pid_t caller);
  [[nodiscard]] unsigned poll(Owner owner) const;
  /// Of the mapped buffers; zeros where there are none.
  [[nodiscard]] std::vector<std::byte> read(std::uint64_t offset, std::size_t bytes) const;
  void release(Owner owner);

  /// Ends this life: every ioctl gives ENODEV, and the hooks are not called any more. Once, from one thread.
  void unplug();
  void trigger();
  void inject(const std::function<void(DoubleFaults&)>& change);
  void configure(const std::function<void(DoubleOptions&)>& change);
  [[nodiscard]] bool is_streaming() const;
  [[nodiscard]] std::optional<int> control(std::uint32_t id) const;

 private:
  struct Range {  ///< of the file, which one buffer is mapped from
    std::uint64_t offset;
    std::vector<std::byte> content;
    Owner owner;
  };
  enum class State { kDequeued, kQueued, kDone };
  struct Buffer {
    std::shared_ptr<Range> range;
    State state = State::kDequeued;
    v4l2_buffer filled{};
  };
  struct Exposure {
    MonotonicTime start;
    std::uint64_t number;
    unsigned stream;
  };

  int ioctl_setting(unsigned command, void* argument);
  int query_capability(v4l2_capability& capability) const;
  int enumerate_format(v4l2_fmtdesc& format) const;
  int enumerate_size(v4l2_frmsizeenum& size) const;
  int enumerate_rate(v4l2_frmivalenum& rate) const;
  int try_format(v4l2_format& format) const;
  int set_format(v4l2_format& format);
  int set_rate(v4l2_streamparm& parameters);
  int request_buffers(Owner owner, v4l2_requestbuffers& request);
  int describe_buffer(v4l2_buffer& buffer) const;
  int queue(Owner owner, v4l2_buffer& buffer);
  int dequeue(Owner owner, v4l2_buffer& buffer);
  int start(Owner owner);
  int stop(Owner owner);
  void end_stream();
  [[nodiscard]] std::shared_ptr<Range> take_range(Owner owner, std::size_t bytes);
  [[nodiscard]] std::size_t frame_bytes() const;

  void run(const std::stop_token& stop);
  [[nodiscard]] bool is_stalled() const;
  [[nodiscard]] bool may_expose() const;
  [[nodiscard]] Exposure begin_exposure();
  void finish_exposure(const Exposure& exposure, std::span<const std::byte> bytes);
  [[nodiscard]] v4l2_buffer fill(Buffer& buffer, const Exposure& exposure, std::span<const std::byte> bytes);
  void wait_until(std::unique_lock<std::mutex>& lock, const std::stop_token& stop, MonotonicTime time);

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  DoubleOptions options_;
  std::atomic<std::uint64_t>& numbers_;
  Hooks hooks_;
  DoubleControls controls_;
  DoubleFaults faults_;
  bool present_ = true;
  std::uint32_t fourcc_;
  std::pair<int, int> size_;
  double rate_hz_;
  Owner owner_ = nullptr;  ///< of the buffers
  std::vector<std::shared_ptr<Range>> ranges_;
  std::vector<Buffer> buffers_;
  std::deque<std::size_t> queued_;
  std::deque<std::size_t> done_;
  bool streaming_ = false;
  unsigned stream_ = 0;  ///< which STREAMON
  std::uint32_t sequence_ = 0;
  int triggers_ = 0;
  std::jthread thread_;
};

}  // namespace slsd::test
