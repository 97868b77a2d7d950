// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/v4l2/mapped_buffers.hpp"

#include <libv4l2.h>
#include <linux/videodev2.h>
#include <sys/mman.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <string>
#include <utility>

namespace slsd {
namespace {

constexpr std::size_t kFewest = 3;  // one lent, one being filled, one waiting

}  // namespace

/// The mappings, and who holds them: the owner and each frame count once, and the last to go deletes them.
struct MappedBuffers::Buffers {
  std::array<std::span<std::byte>, VIDEO_MAX_FRAME> mapped{};
  std::array<std::atomic<bool>, VIDEO_MAX_FRAME> lent{};
  std::size_t count = 0;
  std::atomic<int> holders{1};

  ~Buffers() {
    for (std::size_t i = 0; i < count; ++i) munmap(mapped[i].data(), mapped[i].size());
  }
  void release() {
    if (holders.fetch_sub(1, std::memory_order_acq_rel) == 1) delete this;
  }
  void give_back(std::size_t buffer) {
    lent[buffer].store(false, std::memory_order_release);
    release();
  }
};

MappedBuffers::MappedBuffers() : buffers_(new Buffers) {}

MappedBuffers::MappedBuffers(MappedBuffers&& other) noexcept : buffers_(std::exchange(other.buffers_, nullptr)) {}

MappedBuffers& MappedBuffers::operator=(MappedBuffers&& other) noexcept {
  std::swap(buffers_, other.buffers_);
  return *this;
}

MappedBuffers::~MappedBuffers() {
  if (buffers_ != nullptr) buffers_->release();
}

Result<MappedBuffers> MappedBuffers::request(const V4l2Device& device, int count) {
  v4l2_requestbuffers request{};
  request.count = static_cast<__u32>(count);
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int error = device.call(VIDIOC_REQBUFS, &request))
    return device.fail_call(error, "cannot get buffers of the camera");
  if (request.count < kFewest || request.count > VIDEO_MAX_FRAME)
    return fail(ErrorCode::kUnsupported, "the driver gives " + std::to_string(request.count) + " buffers, 3 are needed",
                device.path());
  MappedBuffers buffers;
  for (std::size_t i = 0; i < request.count; ++i) {
    if (auto mapped = buffers.map(device, i); !mapped) return tl::unexpected(mapped.error());
  }
  return buffers;
}

Result<> MappedBuffers::map(const V4l2Device& device, std::size_t buffer) {
  v4l2_buffer described{};
  described.index = static_cast<__u32>(buffer);
  described.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  described.memory = V4L2_MEMORY_MMAP;
  if (const int error = device.call(VIDIOC_QUERYBUF, &described))
    return device.fail_call(error, "cannot find the camera's buffers");
  void* memory = v4l2_mmap(nullptr, described.length, PROT_READ, MAP_SHARED, device.descriptor(), described.m.offset);
  if (memory == MAP_FAILED) return device.fail_call(errno, "cannot map the camera's buffers");
  buffers_->mapped[buffer] = {static_cast<std::byte*>(memory), described.length};
  buffers_->count = buffer + 1;
  return {};
}

std::size_t MappedBuffers::size() const {
  return buffers_->count;
}

std::span<std::byte> MappedBuffers::bytes(std::size_t buffer) const {
  return buffers_->mapped[buffer];
}

Frame MappedBuffers::lend(std::size_t buffer, const GreyView& image, std::uint64_t sequence,
                          MonotonicTime exposure_start, MonotonicTime received) {
  buffers_->lent[buffer].store(true, std::memory_order_relaxed);
  buffers_->holders.fetch_add(1, std::memory_order_relaxed);
  return {image, sequence, exposure_start, received, [buffers = buffers_, buffer] { buffers->give_back(buffer); }};
}

bool MappedBuffers::is_lent(std::size_t buffer) const {
  return buffers_->lent[buffer].load(std::memory_order_acquire);
}

}  // namespace slsd
