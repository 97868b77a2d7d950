// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "drivers/camera/aravis/aravis_camera_options.hpp"
#include "drivers/camera/aravis/capture_events.hpp"
#include "drivers/camera/aravis/configure_network.hpp"
#include "drivers/camera/aravis/device_control.hpp"
#include "drivers/camera/aravis/frame_receiver.hpp"
#include "drivers/camera/aravis/g_object.hpp"
#include "drivers/camera/aravis/open_device.hpp"
#include "drivers/camera/frame.hpp"

namespace slsd {

/// A camera from the moment it is controlled, configured and sending, to its loss or end.
/// @thread thread-bound; may be destroyed on another thread
class AravisSession {
 public:
  /// Opens and configures everything anew, and proves that frames arrive.
  /// @param address  where the camera was found before, or empty
  /// @param events   outlive the session
  /// @errors as open_device(), configure_image(), configure_packets(); kDisconnected: it answers, and no frame arrives
  [[nodiscard]] static Result<std::unique_ptr<AravisSession>> open(const AravisCameraOptions& options,
                                                                   const std::string& address, CaptureEvents& events);
  /// Takes seconds where the device does not answer any more.
  ~AravisSession();
  AravisSession(const AravisSession&) = delete;
  AravisSession& operator=(const AravisSession&) = delete;

  [[nodiscard]] const std::string& name() const { return device_.name; }
  [[nodiscard]] const std::string& address() const { return device_.address; }
  [[nodiscard]] const DeviceLayout& layout() const { return layout_; }
  [[nodiscard]] const std::vector<NetworkWarning>& warnings() const { return warnings_; }
  [[nodiscard]] AravisStatistics statistics() const { return receiver_->statistics(); }
  [[nodiscard]] DeviceClock clock() const { return control_->clock(); }
  /// Whether the device still answers; waits a little for a trigger under way.
  [[nodiscard]] bool answers();
  /// What is left is its end, which may then no more stop the device.
  void abandon() { abandoned_ = true; }

  /// @errors as Camera::capture(); after kDisconnected only the session's end is left
  [[nodiscard]] Result<Frame> capture(MonotonicTime deadline);

 private:
  AravisSession(const AravisCameraOptions& options, OpenedDevice device, CaptureEvents& events);

  [[nodiscard]] Result<> prepare();
  [[nodiscard]] Result<> make_stream();
  [[nodiscard]] Result<> warm_up();
  [[nodiscard]] Result<> start(AravisTrigger trigger);
  [[nodiscard]] Result<> stop();
  [[nodiscard]] bool wait_for_any_frame(AravisTrigger trigger);
  void read_clock_first();

  [[nodiscard]] Result<> settle(MonotonicTime deadline);
  [[nodiscard]] Result<Frame> await_frame(MonotonicTime asked, MonotonicTime deadline);
  [[nodiscard]] std::optional<Result<Frame>> judge(MonotonicTime asked);
  [[nodiscard]] tl::unexpected<Error> missed(MonotonicTime deadline);
  [[nodiscard]] tl::unexpected<Error> lost(const std::string& reason);
  [[nodiscard]] tl::unexpected<Error> fail_here(ErrorCode code, std::string message) const;

  AravisCameraOptions options_;
  OpenedDevice device_;
  CaptureEvents& events_;
  std::uint64_t number_;
  DeviceLayout layout_;
  std::vector<NetworkWarning> warnings_;
  DeviceClock first_clock_;
  GObjectPtr<ArvStream> stream_;
  std::unique_ptr<FrameReceiver> receiver_;
  std::unique_ptr<DeviceControl> control_;
  unsigned long control_lost_handler_ = 0;
  bool abandoned_ = false;
  int frames_due_ = 0;     ///< triggers whose frame has not come
  int frames_missed_ = 0;  ///< frames in a row that did not come; they may still come late
  MonotonicTime triggered_;
};

}  // namespace slsd
