// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>

#include "drivers/camera/aravis/capture_events.hpp"
#include "drivers/camera/aravis/device_clock.hpp"
#include "drivers/camera/aravis/g_object.hpp"
#include "drivers/camera/aravis/ptp_lock.hpp"

namespace slsd {

/// Reads the device's clock, if it has one that can be read.
/// @thread thread-safe for GigE Vision, else thread-bound to the camera
[[nodiscard]] std::optional<ClockReading> read_device_clock(ArvCamera* camera);

/// The thread that talks to the device, "aravis control": a device that is gone answers a command after seconds only,
/// and a capture may not wait for that. It triggers when asked, and reads the device's clock every second.
/// @thread thread-safe
class DeviceControl {
 public:
  /// @param camera  outlives this, and is used by nobody else meanwhile
  /// @param clock   as read so far; never, where the device has none that can be read
  /// @param ptp     as it is now, where the device's clock is to follow the network's; else nothing
  DeviceControl(ArvCamera* camera, CaptureEvents& events, std::uint64_t session, const DeviceClock& clock,
                std::optional<PtpLock> ptp);
  /// Waits for the command under way, for seconds if the device is gone.
  ~DeviceControl() = default;
  DeviceControl(const DeviceControl&) = delete;
  DeviceControl& operator=(const DeviceControl&) = delete;

  void trigger();
  [[nodiscard]] DeviceClock clock() const;
  /// Whether the device's clock is the network's: as it says itself, or because it was not set for a while.
  [[nodiscard]] bool follows_network() const;

 private:
  void run(const std::stop_token& stop);
  void send_trigger();
  void read_clock();
  [[nodiscard]] bool observe_clock();

  ArvCamera* camera_;
  CaptureEvents& events_;
  std::uint64_t session_;
  mutable std::mutex mutex_;
  std::condition_variable_any asked_;
  bool trigger_ = false;
  DeviceClock clock_;
  std::optional<PtpLock> ptp_;
  const bool readable_;
  std::jthread thread_;
};

}  // namespace slsd
