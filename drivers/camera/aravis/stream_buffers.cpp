// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/stream_buffers.hpp"

#include <mutex>

namespace slsd {

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

}  // namespace slsd
