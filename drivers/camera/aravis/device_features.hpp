// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/result.hpp"
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

  ArvCamera* camera_;
};

}  // namespace slsd
