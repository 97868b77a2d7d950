// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/device/device_control.hpp"

#include <chrono>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "drivers/system/thread_name.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

tl::unexpected<Error> fail_taken(const char* name, const std::string& asked, const std::string& taken) {
  return fail(ErrorCode::kMismatch,
              "the camera set " + taken + " instead of " + asked + "; choose a value that it supports", name);
}

std::string text(double value) {
  std::string digits = std::to_string(value);
  digits.erase(digits.find_last_not_of('0') + 1);
  if (digits.back() == '.') digits.pop_back();
  return digits;
}

constexpr auto kClockPeriod = 1s;
constexpr auto kSteady = 10s;  // a clock that will follow the network's is set before this
constexpr std::uint64_t kControlRegister = 0x944;
constexpr std::uint64_t kLatchedHigh = 0x948;
constexpr std::uint64_t kLatchedLow = 0x94c;
constexpr std::uint32_t kLatch = 2;

// Uses the bootstrap registers, which the standard prescribes: cameras differ in their features for this.
std::optional<ClockReading> latch_registers(ArvDevice* device) {
  GErrorSlot error;
  const std::uint64_t frequency = arv_gv_device_get_timestamp_tick_frequency(ARV_GV_DEVICE(device), error.out());
  if (error.failed() || frequency == 0) return std::nullopt;
  ClockReading reading;
  guint32 high = 0;
  guint32 low = 0;
  reading.before = steady_clock::now();
  bool done = arv_device_write_register(device, kControlRegister, kLatch, error.out());
  reading.after = steady_clock::now();
  done = done && arv_device_read_register(device, kLatchedHigh, &high, error.out());
  done = done && arv_device_read_register(device, kLatchedLow, &low, error.out());
  if (!done) return std::nullopt;
  reading.device = from_ticks(std::uint64_t{high} << 32 | low, frequency);
  return reading;
}

std::optional<ClockReading> latch_features(ArvCamera* camera) {
  GErrorSlot error;
  if (!arv_camera_is_feature_available(camera, "TimestampLatch", error.out()) || error.failed()) return std::nullopt;
  ClockReading reading;
  reading.before = steady_clock::now();
  arv_camera_execute_command(camera, "TimestampLatch", error.out());
  reading.after = steady_clock::now();
  if (error.failed()) return std::nullopt;
  reading.device = std::chrono::nanoseconds(arv_camera_get_integer(camera, "TimestampLatchValue", error.out()));
  return error.failed() ? std::nullopt : std::optional(reading);
}

}  // namespace

bool DeviceFeatures::has(const char* name) const {
  GErrorSlot error;
  return arv_camera_is_feature_implemented(camera_, name, error.out()) && !error.failed() &&
         arv_camera_is_feature_available(camera_, name, error.out()) && !error.failed();
}

bool DeviceFeatures::has_entry(const char* name, const char* entry) const {
  GErrorSlot error;
  return has(name) && arv_camera_is_enumeration_entry_available(camera_, name, entry, error.out()) && !error.failed();
}

Result<> DeviceFeatures::check(const GErrorSlot& error, const char* name) const {
  if (!error.failed()) return {};
  return fail(error.code(), "the camera refuses the setting: " + error.message(), name);
}

Result<> DeviceFeatures::choose(const char* name, const std::string& entry) const {
  GErrorSlot error;
  arv_camera_set_string(camera_, name, entry.c_str(), error.out());
  if (auto done = check(error, name); !done) {
    if (done.error().code == ErrorCode::kUnsupported) done.error().message = "the camera has no " + entry + " here";
    return done;
  }
  const char* taken = arv_camera_get_string(camera_, name, error.out());
  if (auto done = check(error, name); !done) return done;
  return taken == entry ? Result<>() : fail_taken(name, entry, taken == nullptr ? "nothing" : printable(taken));
}

// Many cameras silently accept values outside their range, and expose differently.
Result<> DeviceFeatures::check_range(const char* name, double value, double tolerance) const {
  GErrorSlot error;
  double low = 0, high = 0;
  arv_camera_get_float_bounds(camera_, name, &low, &high, error.out());
  if (error.failed() || !(low < high)) return {};  // the camera reports no range
  if (value >= low - tolerance && value <= high + tolerance) return {};
  return fail(ErrorCode::kInvalidArgument,
              "the camera takes " + text(low) + " to " + text(high) + ", not " + text(value), name);
}

Result<> DeviceFeatures::set(const char* name, double value, double tolerance) const {
  if (auto within = check_range(name, value, tolerance); !within) return within;
  GErrorSlot error;
  arv_camera_set_float(camera_, name, value, error.out());
  if (auto done = check(error, name); !done) return done;
  const double taken = arv_camera_get_float(camera_, name, error.out());
  if (auto done = check(error, name); !done) return done;
  return std::abs(taken - value) <= tolerance ? Result<>() : fail_taken(name, text(value), text(taken));
}

Result<> DeviceFeatures::set(const char* name, std::int64_t value) const {
  GErrorSlot error;
  arv_camera_set_integer(camera_, name, value, error.out());
  if (auto done = check(error, name); !done) return done;
  const std::int64_t taken = arv_camera_get_integer(camera_, name, error.out());
  if (auto done = check(error, name); !done) return done;
  return taken == value ? Result<>() : fail_taken(name, std::to_string(value), std::to_string(taken));
}

Result<> DeviceFeatures::turn(const char* name, bool on) const {
  GErrorSlot error;
  arv_camera_set_boolean(camera_, name, on ? TRUE : FALSE, error.out());
  if (auto done = check(error, name); !done) return done;
  const bool taken = arv_camera_get_boolean(camera_, name, error.out()) != FALSE;
  if (auto done = check(error, name); !done) return done;
  return taken == on ? Result<>() : fail_taken(name, on ? "true" : "false", taken ? "true" : "false");
}

Result<> DeviceFeatures::execute(const char* name) const {
  GErrorSlot error;
  arv_camera_execute_command(camera_, name, error.out());
  return check(error, name);
}

Result<int> DeviceFeatures::integer(const char* name) const {
  GErrorSlot error;
  const gint64 value = arv_camera_get_integer(camera_, name, error.out());
  if (auto done = check(error, name); !done) return tl::unexpected(done.error());
  return static_cast<int>(value);
}

std::optional<double> DeviceFeatures::rate_hz() const {
  GErrorSlot error;
  const double rate = arv_camera_get_frame_rate(camera_, error.out());
  return !error.failed() && std::isfinite(rate) && rate >= 0.01 ? std::optional(rate) : std::nullopt;
}

Result<> DeviceFeatures::choose_if_there(const char* name, const std::string& entry) const {
  return has(name) ? choose(name, entry) : Result<>();
}

Result<> DeviceFeatures::turn_if_there(const char* name, bool on) const {
  return has(name) ? turn(name, on) : Result<>();
}

// If the camera has a latch, the status dates from its last use.
PtpLock read_ptp_lock(ArvCamera* camera) {
  const DeviceFeatures features(camera);
  for (const auto& [latch, name] :
       {std::pair("PtpDataSetLatch", "PtpStatus"), std::pair("GevIEEE1588DataSetLatch", "GevIEEE1588Status")}) {
    if (features.has(latch)) (void)features.execute(latch);
    if (!features.has(name)) continue;
    GErrorSlot error;
    const char* const text = arv_camera_get_string(camera, name, error.out());
    const std::string_view status = text == nullptr || error.failed() ? "" : text;
    return status == "Slave" || status == "Master" ? PtpLock::kLocked : PtpLock::kOpen;
  }
  return PtpLock::kUnknown;
}

std::optional<ClockReading> read_device_clock(ArvCamera* camera) {
  ArvDevice* device = arv_camera_get_device(camera);
  return ARV_IS_GV_DEVICE(device) ? latch_registers(device) : latch_features(camera);
}

DeviceControl::DeviceControl(ArvCamera* camera, CaptureEvents& events, std::uint64_t session, const DeviceClock& clock,
                             std::optional<PtpLock> ptp)
    : camera_(camera),
      events_(events),
      session_(session),
      clock_(clock),
      ptp_(ptp),
      readable_(clock.was_read()),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

void DeviceControl::trigger() {
  events_.note_trigger_asked();
  const std::lock_guard lock(mutex_);
  trigger_ = true;
  asked_.notify_one();
}

DeviceClock DeviceControl::clock() const {
  const std::lock_guard lock(mutex_);
  return clock_;
}

bool DeviceControl::follows_network() const {
  const std::lock_guard lock(mutex_);
  if (!ptp_ || !clock_.ready()) return false;
  if (*ptp_ == PtpLock::kUnknown) return steady_clock::now() - clock_.steady_since() >= kSteady;
  return *ptp_ == PtpLock::kLocked;
}

void DeviceControl::run(const std::stop_token& stop) {
  name_this_thread("aravis control");
  auto next_reading = steady_clock::now() + kClockPeriod;
  while (!stop.stop_requested()) {
    bool asked = false;
    {
      std::unique_lock lock(mutex_);
      asked_.wait_until(lock, stop, next_reading, [this] { return trigger_; });
      asked = std::exchange(trigger_, false);
    }
    const std::lock_guard lock(using_camera_);
    if (asked) {
      send_trigger();
    } else if (steady_clock::now() >= next_reading) {
      read_clock();
      next_reading = steady_clock::now() + kClockPeriod;
    }
  }
}

void DeviceControl::send_trigger() {
  GErrorSlot error;
  arv_camera_software_trigger(camera_, error.out());
  if (error.failed()) events_.report_lost(session_, "the camera refuses a trigger: " + error.message());
  events_.report_trigger_answered(session_);
}

// Read the clock first, because it detects a lost device soonest; and once more, because it is set before it is locked.
void DeviceControl::read_clock() {
  if (!readable_ || !observe_clock() || !ptp_) return;
  const PtpLock ptp = read_ptp_lock(camera_);
  if (!observe_clock()) return;
  const std::lock_guard lock(mutex_);
  ptp_ = ptp;
}

bool DeviceControl::observe_clock() {
  const auto reading = read_device_clock(camera_);
  if (!reading) {
    events_.report_lost(session_, "the camera no longer answers");
    return false;
  }
  const std::lock_guard lock(mutex_);
  clock_.observe(*reading);
  return true;
}

}  // namespace slsd
