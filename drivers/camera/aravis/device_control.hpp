// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "core/result.hpp"
#include "drivers/camera/aravis/capture_events.hpp"
#include "drivers/camera/aravis/device_clock.hpp"
#include "drivers/camera/aravis/g_object.hpp"

namespace slsd {

/// The settings of a camera by their names in the Standard Features Naming Convention. What is set is read back: many a
/// camera rounds or refuses in silence.
/// @thread thread-bound
class DeviceFeatures {
 public:
  /// @param camera  outlives this
  explicit DeviceFeatures(ArvCamera* camera) : camera_(camera) {}

  [[nodiscard]] bool has(const char* name) const;
  [[nodiscard]] bool has_entry(const char* name, const char* entry) const;

  /// @errors for all of these: kUnsupported (lacking or refused), kMismatch (it took another value), kDisconnected
  [[nodiscard]] Result<> choose(const char* name, const std::string& entry) const;
  /// @errors also kInvalidArgument: beyond the range that the camera tells
  [[nodiscard]] Result<> set(const char* name, double value, double tolerance) const;
  [[nodiscard]] Result<> set(const char* name, std::int64_t value) const;
  [[nodiscard]] Result<> turn(const char* name, bool on) const;
  [[nodiscard]] Result<> execute(const char* name) const;
  [[nodiscard]] Result<int> integer(const char* name) const;
  /// Frames a second where it runs freely; nothing where it does not say.
  [[nodiscard]] std::optional<double> rate_hz() const;

  /// The same where the camera has the feature, and nothing where it has not.
  [[nodiscard]] Result<> choose_if_there(const char* name, const std::string& entry) const;
  [[nodiscard]] Result<> turn_if_there(const char* name, bool on) const;

 private:
  [[nodiscard]] Result<> check(const GErrorSlot& error, const char* name) const;
  [[nodiscard]] Result<> check_range(const char* name, double value, double tolerance) const;

  ArvCamera* camera_;
};

/// The lock of a device's clock to the network's (IEEE 1588). It takes seconds after opening.
enum class PtpLock {
  kUnknown,  ///< the device does not tell
  kOpen,     ///< it has a clock of its own, or is about to set it
  kLocked    ///< it follows a master's clock, or is the master
};

/// Asks the device.
/// @thread thread-safe for GigE Vision, else thread-bound to the camera
[[nodiscard]] PtpLock read_ptp_lock(ArvCamera* camera);

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
  /// Tells whether the device's clock is the network's: as it says itself, or because it was not set for a while.
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
