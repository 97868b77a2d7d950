// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <functional>

#include "drivers/camera/aravis/g_object.hpp"

namespace slsd {

/// The buffers of one stream, each with the stream or lent to a frame. Frames may outlive the stream: a buffer that is
/// given back after its end is freed.
/// @thread thread-bound; give_back() may be called from any thread
class StreamBuffers {
 public:
  /// Allocates the buffers and hands them to the stream.
  StreamBuffers(ArvStream* stream, std::size_t bytes_each, int buffers);
  /// The stream is not used from then on.
  ~StreamBuffers();
  StreamBuffers(const StreamBuffers&) = delete;
  StreamBuffers& operator=(const StreamBuffers&) = delete;

  [[nodiscard]] int lent() const;
  /// Notes that a buffer taken from the stream is lent; what is returned gives it back, once.
  [[nodiscard]] std::function<void()> lend(ArvBuffer* buffer);
  /// For a buffer that was not lent.
  void return_unread(ArvBuffer* buffer);

 private:
  struct Shared;
  Shared* shared_;  ///< counted by itself, so that a lease fits into std::function without an allocation
};

}  // namespace slsd
