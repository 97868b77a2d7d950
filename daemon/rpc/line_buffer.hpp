// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace slsd {

/// Cuts a stream of bytes into lines, in a time that grows with the bytes alone, however many lines they are. Holds at
/// most one line's limit and what was appended last.
/// @thread thread-bound
class LineBuffer {
 public:
  /// @param limit_bytes  the longest line, without its line feed
  explicit LineBuffer(std::size_t limit_bytes) : limit_bytes_(limit_bytes) {}

  void append(std::string_view bytes);

  /// The next whole line without its line feed or carriage return and line feed; nothing where none is whole. Valid
  /// until the next call.
  [[nodiscard]] std::optional<std::string_view> next_line();
  /// The rest when no more bytes come: a last line that lacks its line feed. Empty if nothing is left. Valid until the
  /// next call.
  [[nodiscard]] std::optional<std::string_view> rest();

  /// Tells whether the line that has begun is longer than the limit.
  [[nodiscard]] bool overflown() const { return bytes_.size() - begin_ > limit_bytes_ && searched_ == bytes_.size(); }
  /// The number of bytes that wait to be read as lines.
  [[nodiscard]] std::size_t size() const { return bytes_.size() - begin_; }
  /// The allocated memory, in bytes.
  [[nodiscard]] std::size_t capacity() const { return bytes_.capacity(); }
  /// Gives back what it holds, lines that are not read yet with it.
  void clear();

 private:
  std::size_t limit_bytes_;
  std::string bytes_;
  std::size_t begin_ = 0;     ///< start of the next line; the bytes before were read
  std::size_t searched_ = 0;  ///< no line feed from begin_ to here
};

}  // namespace slsd
