// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "drivers/camera/aravis/g_object.hpp"
#include "drivers/camera/frame.hpp"

namespace slsd {

/// The buffers of one stream, each with the stream or lent to a frame. Frames may outlive the stream: a buffer that is
/// given back after its end is freed.
/// @thread thread-bound; the frames that it lends may end on any thread
class StreamBuffers {
 public:
  /// Allocates the buffers and hands them to the stream.
  StreamBuffers(ArvStream* stream, std::size_t bytes_each, int buffers);
  /// The stream is not used from then on.
  ~StreamBuffers();
  StreamBuffers(const StreamBuffers&) = delete;
  StreamBuffers& operator=(const StreamBuffers&) = delete;

  [[nodiscard]] int lent() const;
  /// A lease on a buffer that was taken from the stream.
  [[nodiscard]] FrameLease lend(ArvBuffer* buffer);
  /// For a buffer that was not lent.
  void return_unread(ArvBuffer* buffer);

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;  ///< with the frames
};

}  // namespace slsd
