// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/device_features.hpp"

#include <cmath>

namespace slsd {
namespace {

tl::unexpected<Error> fail_taken(const char* name, const std::string& asked, const std::string& taken) {
  return fail(ErrorCode::kMismatch, "the camera took " + taken + " where " + asked + " was set; set what it can do",
              name);
}

std::string text(double value) {
  std::string digits = std::to_string(value);
  digits.erase(digits.find_last_not_of('0') + 1);
  if (digits.back() == '.') digits.pop_back();
  return digits;
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

Result<> DeviceFeatures::set(const char* name, double value, double tolerance) const {
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

}  // namespace slsd
