// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/stream_buffers.hpp"

#include <atomic>
#include <mutex>

namespace slsd {

/// The stream, and who may still give back to it: the owner and each lease count once, and the last to go deletes it.
struct StreamBuffers::Shared {
  explicit Shared(ArvStream* of) : stream(of) {}

  void give_back(ArvBuffer* buffer) {
    const std::lock_guard lock(mutex);
    if (stream != nullptr)
      arv_stream_push_buffer(stream, buffer);
    else
      g_object_unref(buffer);
  }

  void end_lease(ArvBuffer* buffer) {
    give_back(buffer);
    lent.fetch_sub(1, std::memory_order_release);
    release();
  }

  void release() {
    if (holders.fetch_sub(1, std::memory_order_acq_rel) == 1) delete this;
  }

  std::mutex mutex;
  ArvStream* stream;
  std::atomic<int> lent{0};
  std::atomic<int> holders{1};
};

StreamBuffers::StreamBuffers(ArvStream* stream, std::size_t bytes_each, int buffers) : shared_(new Shared(stream)) {
  for (int i = 0; i < buffers; ++i) arv_stream_push_buffer(stream, arv_buffer_new_allocate(bytes_each));
}

StreamBuffers::~StreamBuffers() {
  {
    const std::lock_guard lock(shared_->mutex);
    shared_->stream = nullptr;
  }
  shared_->release();
}

int StreamBuffers::lent() const {
  return shared_->lent.load(std::memory_order_acquire);
}

std::function<void()> StreamBuffers::lend(ArvBuffer* buffer) {
  shared_->lent.fetch_add(1, std::memory_order_relaxed);
  shared_->holders.fetch_add(1, std::memory_order_relaxed);
  return [shared = shared_, buffer] { shared->end_lease(buffer); };
}

void StreamBuffers::return_unread(ArvBuffer* buffer) {
  shared_->give_back(buffer);
}

}  // namespace slsd
