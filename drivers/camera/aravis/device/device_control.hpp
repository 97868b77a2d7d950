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
#include "drivers/camera/aravis/device/device_clock.hpp"
#include "drivers/camera/aravis/frames/capture_events.hpp"
#include "drivers/camera/aravis/g_object.hpp"

namespace slsd {

/// Sets a camera's features by their names in the Standard Features Naming Convention. Reads each value back, because
/// many cameras silently round or refuse it.
/// @thread thread-bound
class DeviceFeatures {
 public:
  /// @param camera  must outlive this object
  explicit DeviceFeatures(ArvCamera* camera) : camera_(camera) {}

  [[nodiscard]] bool has(const char* name) const;
  [[nodiscard]] bool has_entry(const char* name, const char* entry) const;

  /// @errors for all of these: kUnsupported (missing or refused), kMismatch (the camera took another value),
  ///         kDisconnected
  [[nodiscard]] Result<> choose(const char* name, const std::string& entry) const;
  /// @errors also kInvalidArgument: outside the range that the camera reports
  [[nodiscard]] Result<> set(const char* name, double value, double tolerance) const;
  [[nodiscard]] Result<> set(const char* name, std::int64_t value) const;
  [[nodiscard]] Result<> turn(const char* name, bool on) const;
  [[nodiscard]] Result<> execute(const char* name) const;
  [[nodiscard]] Result<int> integer(const char* name) const;
  /// Frames per second in free run; empty if the camera does not report it.
  [[nodiscard]] std::optional<double> rate_hz() const;

  /// Does the same if the camera has the feature; otherwise nothing.
  [[nodiscard]] Result<> choose_if_there(const char* name, const std::string& entry) const;
  [[nodiscard]] Result<> turn_if_there(const char* name, bool on) const;

 private:
  [[nodiscard]] Result<> check(const GErrorSlot& error, const char* name) const;
  [[nodiscard]] Result<> check_range(const char* name, double value, double tolerance) const;

  ArvCamera* camera_;
};

/// Lock of a device's clock to the network's (IEEE 1588). Locking takes seconds after opening.
enum class PtpLock {
  kUnknown,  ///< the device does not report it
  kOpen,     ///< the device uses its own clock, or is about to set it
  kLocked    ///< the device follows a master's clock, or is the master
};

/// Reads the state of the lock from the device.
/// @thread thread-safe for GigE Vision, else thread-bound to the camera
[[nodiscard]] PtpLock read_ptp_lock(ArvCamera* camera);

/// Reads the device's clock, if it has a readable one.
/// @thread thread-safe for GigE Vision, else thread-bound to the camera
[[nodiscard]] std::optional<ClockReading> read_device_clock(ArvCamera* camera);

/// The thread "aravis control", which talks to the device. A lost device answers a command only after seconds, and a
/// capture must not wait for that. The thread triggers on request, and reads the device's clock every second.
/// @thread thread-safe
class DeviceControl {
 public:
  /// @param camera  must outlive this object; others use it only through use_camera()
  /// @param clock   its readings so far; never read if the device has no readable clock
  /// @param ptp     its current state if the device's clock should follow the network's; else nothing
  DeviceControl(ArvCamera* camera, CaptureEvents& events, std::uint64_t session, const DeviceClock& clock,
                std::optional<PtpLock> ptp);
  /// Waits for the command under way; for seconds if the device is gone.
  ~DeviceControl() = default;
  DeviceControl(const DeviceControl&) = delete;
  DeviceControl& operator=(const DeviceControl&) = delete;

  void trigger();
  /// Runs a job that uses the camera, once the command under way has ended. Runs it on the calling thread.
  /// @return the job's outcome
  template <class Job>
  [[nodiscard]] auto use_camera(Job job) {
    const std::lock_guard lock(using_camera_);
    return job();
  }
  [[nodiscard]] DeviceClock clock() const;
  /// Tells whether the device's clock follows the network's: the device reports it, or its clock was not set for a
  /// while.
  [[nodiscard]] bool follows_network() const;

 private:
  void run(const std::stop_token& stop);
  void send_trigger();
  void read_clock();
  [[nodiscard]] bool observe_clock();

  ArvCamera* camera_;
  CaptureEvents& events_;
  std::uint64_t session_;
  std::mutex using_camera_;
  mutable std::mutex mutex_;
  std::condition_variable_any asked_;
  bool trigger_ = false;
  DeviceClock clock_;
  std::optional<PtpLock> ptp_;
  const bool readable_;
  std::jthread thread_;
};

}  // namespace slsd
