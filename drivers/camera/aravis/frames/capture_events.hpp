// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>

#include "drivers/camera/aravis/g_object.hpp"
#include "drivers/camera/frame.hpp"

namespace slsd {

/// The events that a capture waits for: completed buffers, the answer to a trigger, the loss of the camera, and
/// cancel(). Ignores reports of an earlier session that is still being closed.
/// @thread thread-safe
class CaptureEvents {
 public:
  enum class Wake { kBuffer, kTimeout, kCancelled, kLost };

  /// Forgets all events, including a cancel().
  /// @return the number with which the new session reports
  std::uint64_t begin_session();

  void report_buffer(std::uint64_t session);
  void report_trigger_answered(std::uint64_t session);
  void report_lost(std::uint64_t session, const std::string& reason);
  void cancel();

  /// Waits for one buffer, which the caller may then take.
  [[nodiscard]] Wake wait_buffer(MonotonicTime until);
  [[nodiscard]] bool take_buffer();
  [[nodiscard]] bool take_cancel();

  void note_trigger_asked();
  /// Waits until the previous trigger is answered: then kBuffer.
  [[nodiscard]] Wake wait_trigger_answered(MonotonicTime until);
  [[nodiscard]] bool trigger_answered() const;

  /// The cause of the camera's loss; empty unless it is lost.
  [[nodiscard]] std::string lost_reason() const;

 private:
  template <class Condition>
  Wake wait(MonotonicTime until, Condition condition);

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t session_ = 0;
  int buffers_ = 0;
  int triggers_open_ = 0;
  bool cancelled_ = false;
  std::string lost_;
};

/// Makes the camera's stream. It reports each completed buffer and stamps it with the time.
/// @param events  must outlive the stream
[[nodiscard]] GObjectPtr<ArvStream> make_reporting_stream(ArvCamera* camera, CaptureEvents& events,
                                                          std::uint64_t session, GErrorSlot& error);

/// Makes the device report when it stops answering, or when another application takes control.
/// @return the handler; disconnect it before the events end
[[nodiscard]] unsigned long report_loss(ArvDevice* device, CaptureEvents& events, std::uint64_t session);

}  // namespace slsd
