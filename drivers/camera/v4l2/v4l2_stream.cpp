// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/v4l2/v4l2_stream.hpp"

#include <libv4l2.h>
#include <sys/mman.h>

#include <cerrno>
#include <string>
#include <utility>

namespace slsd {
namespace {

constexpr std::size_t kFewest = 3;  // one lent, one being filled, one waiting

v4l2_buffer describe(std::size_t buffer) {
  v4l2_buffer described{};
  described.index = static_cast<__u32>(buffer);
  described.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  described.memory = V4L2_MEMORY_MMAP;
  return described;
}

}  // namespace

Result<std::shared_ptr<MappedBuffers>> MappedBuffers::request(const V4l2Device& device, int count) {
  v4l2_requestbuffers request{};
  request.count = static_cast<__u32>(count);
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int error = device.call(VIDIOC_REQBUFS, &request))
    return device.fail_call(error, "cannot allocate the camera's buffers");
  if (request.count < kFewest || request.count > VIDEO_MAX_FRAME)
    return fail(ErrorCode::kUnsupported,
                "the driver gives " + std::to_string(request.count) + " buffers, but 3 are needed", device.path());
  auto buffers = std::make_shared<MappedBuffers>(request.count);
  for (std::size_t i = 0; i < request.count; ++i) {
    if (auto mapped = buffers->map(device, i); !mapped) return tl::unexpected(mapped.error());
  }
  return buffers;
}

MappedBuffers::~MappedBuffers() {
  for (const auto& mapping : mapped_)
    if (!mapping.empty()) munmap(mapping.data(), mapping.size());
}

Result<> MappedBuffers::map(const V4l2Device& device, std::size_t buffer) {
  v4l2_buffer described = describe(buffer);
  if (const int error = device.call(VIDIOC_QUERYBUF, &described))
    return device.fail_call(error, "cannot find the camera's buffers");
  void* memory = v4l2_mmap(nullptr, described.length, PROT_READ, MAP_SHARED, device.descriptor(), described.m.offset);
  if (memory == MAP_FAILED) return device.fail_call(errno, "cannot map the camera's buffers");
  mapped_[buffer] = {static_cast<std::byte*>(memory), described.length};
  return {};
}

V4l2Stream::V4l2Stream(V4l2Device device, std::shared_ptr<MappedBuffers> buffers)
    : device_(std::move(device)), buffers_(std::move(buffers)) {}

Result<V4l2Stream> V4l2Stream::start(V4l2Device device, int buffers) {
  auto mapped = MappedBuffers::request(device, buffers);
  if (!mapped) return tl::unexpected(mapped.error());
  V4l2Stream stream(std::move(device), std::move(*mapped));
  if (auto queued = stream.put_back_returned(); !queued) return tl::unexpected(queued.error());
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  const int error = stream.device_.call(VIDIOC_STREAMON, &type);
  if (error == ENOSPC) {
    return fail(
        ErrorCode::kNoSpace,
        "its bus lacks bandwidth for the frames; lower frame_rate_hz or the size, or give the camera its own bus",
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
  // The buffers must have no owner before another open(): lent buffers keep the file itself open.
  v4l2_requestbuffers none{};
  none.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  none.memory = V4L2_MEMORY_MMAP;
  [[maybe_unused]] const int given_back = device_.call(VIDIOC_REQBUFS, &none);
}

Result<std::optional<v4l2_buffer>> V4l2Stream::take() {
  v4l2_buffer filled = describe(0);
  const int error = device_.call(VIDIOC_DQBUF, &filled);
  if (error == EAGAIN) return std::nullopt;
  if (error == EIO) return fail(ErrorCode::kIo, "the driver reports a temporary fault; scan again", device_.path());
  if (error != 0 || filled.index >= buffers_->size() || !with_driver_[filled.index])
    return fail(ErrorCode::kDisconnected, "the camera is gone; check its cable", device_.path());
  with_driver_[filled.index] = false;
  --queued_;
  quiet_since_ = std::chrono::steady_clock::now();
  return filled;
}

Result<> V4l2Stream::put_back(std::size_t buffer) {
  v4l2_buffer empty = describe(buffer);
  if (device_.call(VIDIOC_QBUF, &empty) != 0)
    return fail(ErrorCode::kDisconnected, "the camera no longer takes buffers; check its cable", device_.path());
  with_driver_[buffer] = true;
  if (queued_++ == 0) quiet_since_ = std::chrono::steady_clock::now();
  return {};
}

Result<> V4l2Stream::put_back_returned(std::size_t queued_max) {
  for (std::size_t i = 0; i < buffers_->size() && queued_ < queued_max; ++i) {
    if (with_driver_[i] || buffers_->is_lent(i)) continue;
    if (auto put = put_back(i); !put) return put;
  }
  return {};
}

}  // namespace slsd
