// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "drivers/camera/aravis/action_group.hpp"
#include "drivers/camera/aravis/aravis_camera_options.hpp"
#include "drivers/camera/aravis/capture_events.hpp"
#include "drivers/camera/aravis/configure_device.hpp"
#include "drivers/camera/aravis/configure_network.hpp"
#include "drivers/camera/aravis/device_control.hpp"
#include "drivers/camera/aravis/fragment_watch.hpp"
#include "drivers/camera/aravis/frame_capture.hpp"
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
  /// @param found    called once the camera is this host's, before it is configured; may be empty
  /// @errors as open_device(), configure_image(), configure_packets(); kDisconnected: it answers, and no frame arrives;
  ///         kCancelled
  [[nodiscard]] static Result<std::unique_ptr<AravisSession>> open(const AravisCameraOptions& options,
                                                                   const std::string& address, CaptureEvents& events,
                                                                   const std::function<void()>& found);
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
  /// Looks whether the device's clock can still be trusted. @return whether there is a new warning
  bool note_clock();
  /// Looks for fragments; call it after a frame that did not come whole. @return whether there is a new warning
  bool note_fragments();
  /// Tells whether the device still answers; waits a little for a trigger under way.
  [[nodiscard]] bool answers();
  /// @errors kDisconnected: it was lost while nobody asked for a frame
  [[nodiscard]] Result<> check();
  /// Gives the device up: the session's end will not stop it.
  void abandon();

  /// @errors as Camera::capture(); after kDisconnected only the session's end is left
  [[nodiscard]] Result<Frame> capture(MonotonicTime deadline);
  /// Captures the first frame not yet taken whose exposure did not begin before `since`, from a camera that runs
  /// freely. Works as capture() if `since` is long ago.
  [[nodiscard]] Result<Frame> capture_since(MonotonicTime since, MonotonicTime deadline);

 private:
  /// The fate of the first frame of a stream.
  enum class FirstFrame { kCame, kUnreadable, kMissing };

  AravisSession(const AravisCameraOptions& options, OpenedDevice device, CaptureEvents& events);

  [[nodiscard]] Result<> prepare();
  [[nodiscard]] Result<> begin();
  [[nodiscard]] Result<> join_group();
  [[nodiscard]] Result<> make_stream();
  [[nodiscard]] std::unique_ptr<ChunkReader> make_chunk_reader() const;
  [[nodiscard]] Result<> warm_up(AravisTrigger trigger);
  [[nodiscard]] Result<> go_without_chunks(AravisTrigger trigger);
  [[nodiscard]] bool heard_others() const;
  [[nodiscard]] Result<> hear_camera_only();
  [[nodiscard]] Result<> start(AravisTrigger trigger);
  [[nodiscard]] Result<> stop();
  [[nodiscard]] Result<FirstFrame> wait_for_first_frame(AravisTrigger trigger, std::chrono::nanoseconds time);
  void read_clock_first();
  void read_clock_again();
  [[nodiscard]] tl::unexpected<Error> fail_here(ErrorCode code, std::string message) const;

  AravisCameraOptions options_;
  OpenedDevice device_;
  CaptureEvents& events_;
  std::uint64_t number_;
  DeviceLayout layout_;
  ChunkSelection chunks_;
  std::vector<NetworkWarning> warnings_;
  DeviceClock first_clock_;
  std::optional<PtpLock> first_ptp_;  ///< set if the clock is to follow the network's
  GObjectPtr<ArvStream> stream_;
  std::unique_ptr<FrameReceiver> receiver_;
  std::unique_ptr<DeviceControl> control_;
  std::optional<ActionGroup::Member> action_;  ///< set if the trigger is an action
  std::optional<FrameCapture> frame_capture_;  ///< once it is prepared, until it is abandoned
  unsigned long control_lost_handler_ = 0;
  bool abandoned_ = false;
  FragmentWatch fragments_;
  bool clock_told_ = false;      ///< the warning of it
  bool fragments_told_ = false;  ///< and of these
};

}  // namespace slsd
