// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace slsd {

/// Splits a stream of bytes into lines, in time proportional to the bytes. Holds at most one line's limit and the last
/// appended bytes.
/// @thread thread-bound
class LineBuffer {
 public:
  /// @param limit_bytes  the longest line, without its line feed
  explicit LineBuffer(std::size_t limit_bytes) : limit_bytes_(limit_bytes) {}

  void append(std::string_view bytes);

  /// The next whole line without its line end (LF or CR LF); nothing if none is complete. Valid until the next call.
  [[nodiscard]] std::optional<std::string_view> next_line();
  /// The rest after the last byte of the stream: a last line without a line feed. Empty if nothing is left. Valid until
  /// the next call.
  [[nodiscard]] std::optional<std::string_view> rest();

  /// Tells whether the current line is longer than the limit.
  [[nodiscard]] bool overflown() const { return bytes_.size() - begin_ > limit_bytes_ && searched_ == bytes_.size(); }
  /// The number of bytes not yet read as lines.
  [[nodiscard]] std::size_t size() const { return bytes_.size() - begin_; }
  /// The allocated memory, in bytes.
  [[nodiscard]] std::size_t capacity() const { return bytes_.capacity(); }
  /// Discards all bytes, including unread lines.
  void clear();

 private:
  std::size_t limit_bytes_;
  std::string bytes_;
  std::size_t begin_ = 0;     ///< start of the next line; earlier bytes have been read
  std::size_t searched_ = 0;  ///< no line feed from begin_ to here
};

}  // namespace slsd
