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
#include "drivers/camera/aravis/aravis_camera_options.hpp"
#include "drivers/camera/aravis/device/configure_device.hpp"
#include "drivers/camera/aravis/device/device_control.hpp"
#include "drivers/camera/aravis/device/open_device.hpp"
#include "drivers/camera/aravis/frames/capture_events.hpp"
#include "drivers/camera/aravis/frames/frame_capture.hpp"
#include "drivers/camera/aravis/frames/frame_receiver.hpp"
#include "drivers/camera/aravis/g_object.hpp"
#include "drivers/camera/aravis/gige/action_group.hpp"
#include "drivers/camera/aravis/gige/configure_network.hpp"
#include "drivers/camera/aravis/gige/fragment_watch.hpp"
#include "drivers/camera/frame.hpp"

namespace slsd {

/// A camera from the start of its control, through configuration and streaming, to its loss or end.
/// @thread thread-bound; may be destroyed on another thread
class AravisSession {
 public:
  /// Opens and configures everything again, and verifies that frames arrive.
  /// @param address  where the camera was found before; may be empty
  /// @param events   must outlive the session
  /// @param found    called once this host controls the camera, before configuration; may be empty
  /// @errors as open_device(), configure_image(), configure_packets(); kDisconnected: the camera answers, but no frame
  ///         arrives; kCancelled
  [[nodiscard]] static Result<std::unique_ptr<AravisSession>> open(const AravisCameraOptions& options,
                                                                   const std::string& address, CaptureEvents& events,
                                                                   const std::function<void()>& found);
  /// Takes seconds if the device no longer answers.
  ~AravisSession();
  AravisSession(const AravisSession&) = delete;
  AravisSession& operator=(const AravisSession&) = delete;

  [[nodiscard]] const std::string& name() const { return device_.name; }
  [[nodiscard]] const std::string& address() const { return device_.address; }
  [[nodiscard]] const DeviceLayout& layout() const { return layout_; }
  [[nodiscard]] const std::vector<NetworkWarning>& warnings() const { return warnings_; }
  [[nodiscard]] AravisStatistics statistics() const { return receiver_->statistics(); }
  [[nodiscard]] DeviceClock clock() const { return control_->clock(); }
  /// Checks whether the device's clock is still trustworthy. @return whether there is a new warning
  bool note_clock();
  /// Checks for fragments; call it after an incomplete frame. @return whether there is a new warning
  bool note_fragments();
  /// Tells whether the device still answers; waits briefly for a trigger under way.
  [[nodiscard]] bool answers();
  /// @errors kDisconnected: the camera was lost between captures
  [[nodiscard]] Result<> check();
  void expect(Picture light) { receiver_->expect(light); }
  /// Sets the exposure of the next triggers. @errors of configure_exposure()
  [[nodiscard]] Result<> set_exposure(double exposure_us);
  /// Abandons the device: the session's end will not stop it.
  void abandon();

  /// @errors as Camera::capture(); after kDisconnected, end the session
  [[nodiscard]] Result<Frame> capture(MonotonicTime deadline);
  /// Captures from a camera in free run: the first frame not yet taken whose exposure began at or after `since`. Works
  /// as capture() if `since` is long ago.
  [[nodiscard]] Result<Frame> capture_since(MonotonicTime since, MonotonicTime deadline);

 private:
  /// The outcome of waiting for a stream's first frame.
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
  std::optional<PtpLock> first_ptp_;  ///< set if the device's clock should follow the network's
  GObjectPtr<ArvStream> stream_;
  std::unique_ptr<FrameReceiver> receiver_;
  std::unique_ptr<DeviceControl> control_;
  std::optional<ActionGroup::Member> action_;  ///< set if the trigger is an action
  std::optional<FrameCapture> frame_capture_;  ///< set from its preparation until it is abandoned
  unsigned long control_lost_handler_ = 0;
  bool abandoned_ = false;
  FragmentWatch fragments_;
  bool clock_reported_ = false;      ///< the clock warning was given
  bool fragments_reported_ = false;  ///< the fragment warning was given
};

}  // namespace slsd
