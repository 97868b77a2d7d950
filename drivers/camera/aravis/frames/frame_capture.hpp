// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "core/result.hpp"
#include "drivers/camera/aravis/aravis_camera_options.hpp"
#include "drivers/camera/aravis/device/device_control.hpp"
#include "drivers/camera/aravis/frames/capture_events.hpp"
#include "drivers/camera/aravis/frames/frame_receiver.hpp"
#include "drivers/camera/aravis/gige/action_group.hpp"
#include "drivers/camera/frame.hpp"

namespace slsd {

/// Triggers a streaming camera and waits for the frame of that exposure. Does not take the frame of an earlier trigger,
/// whose capture was cancelled or late.
/// @thread thread-bound
class FrameCapture {
 public:
  /// All parameters must outlive this object.
  /// @param device_name  the user's name for it
  /// @param action       null for other triggers
  FrameCapture(const AravisCameraOptions& options, const std::string& device_name, CaptureEvents& events,
               FrameReceiver& receiver, DeviceControl& control, ActionGroup::Member* action);

  /// @errors kDisconnected: the camera was lost between captures
  [[nodiscard]] Result<> check() const;
  /// @errors as Camera::capture()
  [[nodiscard]] Result<Frame> capture(MonotonicTime deadline);
  /// Captures as AravisSession::capture_since() does.
  [[nodiscard]] Result<Frame> capture_since(MonotonicTime since, MonotonicTime deadline);

 private:
  void trigger(MonotonicTime now);
  [[nodiscard]] std::optional<std::uint64_t> action_time() const;
  [[nodiscard]] Result<> settle(MonotonicTime deadline);
  [[nodiscard]] Result<> wait_until_quiet(MonotonicTime deadline);
  [[nodiscard]] Result<> may_capture(MonotonicTime deadline);
  [[nodiscard]] Result<Frame> expose(MonotonicTime deadline, bool was_quiet);
  [[nodiscard]] Result<Frame> await_frame(MonotonicTime asked, MonotonicTime deadline, bool was_quiet = false);
  [[nodiscard]] std::optional<Result<Frame>> judge(MonotonicTime asked, bool was_quiet);
  [[nodiscard]] bool goes_by_arrival() const { return receiver_.goes_by_arrival(control_.clock()); }
  [[nodiscard]] tl::unexpected<Error> late() const;
  [[nodiscard]] tl::unexpected<Error> missed(MonotonicTime deadline);
  [[nodiscard]] tl::unexpected<Error> lost(const std::string& reason) const;
  [[nodiscard]] tl::unexpected<Error> fail_here(ErrorCode code, std::string message) const;

  const AravisCameraOptions& options_;
  const std::string& device_name_;
  CaptureEvents& events_;
  FrameReceiver& receiver_;
  DeviceControl& control_;
  ActionGroup::Member* action_;
  int frames_due_ = 0;     ///< triggers whose frame has not arrived
  int frames_missed_ = 0;  ///< missing frames in a row; they may still arrive late
  MonotonicTime triggered_;
  int stale_in_a_row_ = 0;
  int passed_over_ = 0;                       ///< stale frames skipped in this capture
  bool out_of_step_ = false;                  ///< the last frame answered an earlier trigger
  std::chrono::nanoseconds longest_wait_{0};  ///< longest wait for a frame
};

}  // namespace slsd
