// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace slsd {

/// The subject of the lines that this thread logs from now on, to the end of the block. The journal keeps it beside
/// each line, so that `journalctl SLSD_CAMERA=left` has them all. Other readers find it in the line's own text.
/// @thread thread-bound
class LogField {
 public:
  /// @param name  as the journal has it: capitals and underscores, "SLSD_" before
  LogField(std::string_view name, std::string value)
      : name_(name), value_(std::move(value)), before_(std::exchange(newest_, this)) {}
  ~LogField() { newest_ = before_; }
  LogField(const LogField&) = delete;
  LogField& operator=(const LogField&) = delete;

  [[nodiscard]] std::string_view name() const { return name_; }
  [[nodiscard]] const std::string& value() const { return value_; }
  /// The fields of the calling thread, the newest first.
  [[nodiscard]] static std::vector<const LogField*> here() {
    std::vector<const LogField*> fields;
    for (const LogField* field = newest_; field != nullptr; field = field->before_) fields.push_back(field);
    return fields;
  }

 private:
  std::string_view name_;
  std::string value_;
  const LogField* before_;
  static inline thread_local const LogField* newest_ = nullptr;
};

}  // namespace slsd
