// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace slsd {

/// Cuts a stream of bytes into lines. Holds at most one line's limit and what was appended last.
/// @thread thread-bound
class LineBuffer {
 public:
  /// @param limit_bytes  the longest line, without its line feed
  explicit LineBuffer(std::size_t limit_bytes) : limit_bytes_(limit_bytes) {}

  void append(std::string_view bytes) { bytes_.append(bytes); }

  /// The next whole line without its line feed or carriage return and line feed; nothing where none is whole.
  [[nodiscard]] std::optional<std::string> next_line();
  /// What is left when no more bytes come: a last line that lacks its line feed. Nothing where nothing is left.
  [[nodiscard]] std::optional<std::string> rest();

  /// Whether the line that has begun is longer than the limit.
  [[nodiscard]] bool overflown() const { return bytes_.size() > limit_bytes_ && searched_ == bytes_.size(); }
  [[nodiscard]] bool empty() const { return bytes_.empty(); }

 private:
  std::size_t limit_bytes_;
  std::string bytes_;
  std::size_t searched_ = 0;  ///< no line feed before
};

}  // namespace slsd
