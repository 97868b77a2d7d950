// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace slsd {

/// The subject of all lines that this thread logs until the end of the block. The journal stores it as a field of each
/// line: `journalctl SLSD_CAMERA=left` finds them all. Readers without the journal find it in the line's text.
/// @thread thread-bound
class LogField {
 public:
  /// @param name  the journal's field name: capitals and underscores, after "SLSD_"
  LogField(std::string_view name, std::string value)
      : name_(name), value_(std::move(value)), before_(std::exchange(newest_, this)) {}
  ~LogField() { newest_ = before_; }
  LogField(const LogField&) = delete;
  LogField& operator=(const LogField&) = delete;

  [[nodiscard]] std::string_view name() const { return name_; }
  [[nodiscard]] const std::string& value() const { return value_; }
  /// The fields of the calling thread, newest first.
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
