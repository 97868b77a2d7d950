// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/v4l2/v4l2_stream.hpp"

#include <cerrno>
#include <string>
#include <utility>

namespace slsd {
namespace {

v4l2_buffer describe(std::size_t buffer) {
  v4l2_buffer described{};
  described.index = static_cast<__u32>(buffer);
  described.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  described.memory = V4L2_MEMORY_MMAP;
  return described;
}

}  // namespace

V4l2Stream::V4l2Stream(V4l2Device device, MappedBuffers buffers)
    : device_(std::move(device)), buffers_(std::move(buffers)) {}

Result<V4l2Stream> V4l2Stream::start(V4l2Device device, int buffers) {
  auto mapped = MappedBuffers::request(device, buffers);
  if (!mapped) return tl::unexpected(mapped.error());
  V4l2Stream stream(std::move(device), std::move(*mapped));
  if (auto queued = stream.put_back_returned(); !queued) return tl::unexpected(queued.error());
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  const int error = stream.device_.call(VIDIOC_STREAMON, &type);
  if (error == ENOSPC) {
    return fail(ErrorCode::kNoSpace,
                "its bus has no room for the frames; lower frame_rate_hz or the size, or give it a bus of its own",
                stream.device_.path());
  }
  if (error != 0) return stream.device_.fail_call(error, "cannot start the camera");
  stream.quiet_since_ = std::chrono::steady_clock::now();
  return stream;
}

V4l2Stream::~V4l2Stream() {
  if (device_.descriptor() < 0) return;
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  [[maybe_unused]] const int stopped = device_.call(VIDIOC_STREAMOFF, &type);
  // The descriptor's owner of the buffers must be none before another open(): lent ones keep the file itself open.
  v4l2_requestbuffers none{};
  none.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  none.memory = V4L2_MEMORY_MMAP;
  [[maybe_unused]] const int given_back = device_.call(VIDIOC_REQBUFS, &none);
}

Result<std::optional<v4l2_buffer>> V4l2Stream::take() {
  v4l2_buffer filled = describe(0);
  const int error = device_.call(VIDIOC_DQBUF, &filled);
  if (error == EAGAIN) return std::nullopt;
  if (error == EIO) return fail(ErrorCode::kIo, "the driver reports a passing fault; scan again", device_.path());
  if (error != 0 || filled.index >= buffers_.size() || !with_driver_[filled.index])
    return fail(ErrorCode::kDisconnected, "the camera is gone; check its cable", device_.path());
  with_driver_[filled.index] = false;
  --queued_;
  quiet_since_ = std::chrono::steady_clock::now();
  return filled;
}

Result<> V4l2Stream::put_back(std::size_t buffer) {
  v4l2_buffer empty = describe(buffer);
  if (device_.call(VIDIOC_QBUF, &empty) != 0)
    return fail(ErrorCode::kDisconnected, "the camera takes no buffers any more; check its cable", device_.path());
  with_driver_[buffer] = true;
  if (queued_++ == 0) quiet_since_ = std::chrono::steady_clock::now();
  return {};
}

Result<> V4l2Stream::put_back_returned(std::size_t queued_max) {
  for (std::size_t i = 0; i < buffers_.size() && queued_ < queued_max; ++i) {
    if (with_driver_[i] || buffers_.is_lent(i)) continue;
    if (auto put = put_back(i); !put) return put;
  }
  return {};
}

Frame V4l2Stream::lend(std::size_t buffer, const GreyView& image, std::uint64_t sequence, MonotonicTime exposure_start,
                       MonotonicTime received) {
  return buffers_.lend(buffer, image, sequence, exposure_start, received);
}

std::size_t V4l2Stream::lent() const {
  std::size_t count = 0;
  for (std::size_t i = 0; i < buffers_.size(); ++i) count += buffers_.is_lent(i) ? 1 : 0;
  return count;
}

}  // namespace slsd
