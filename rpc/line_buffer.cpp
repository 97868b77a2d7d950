// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "rpc/line_buffer.hpp"

namespace slsd {
namespace {

constexpr std::size_t kKeptBytes = 64 << 10;  // a longer buffer is freed when empty

std::string_view without_carriage_return(std::string_view line) {
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

}  // namespace

// Removes read lines here, once for each chunk. Removing them one by one would take quadratic time.
void LineBuffer::append(std::string_view bytes) {
  if (begin_ > 0) {
    bytes_.erase(0, begin_);
    searched_ -= begin_;
    begin_ = 0;
  }
  bytes_.append(bytes);
}

std::optional<std::string_view> LineBuffer::next_line() {
  const std::size_t end = bytes_.find('\n', searched_);
  if (end == std::string::npos || end - begin_ > limit_bytes_) {
    searched_ = bytes_.size();
    if (begin_ == bytes_.size()) clear();
    return std::nullopt;
  }
  const auto line = std::string_view(bytes_).substr(begin_, end - begin_);
  begin_ = searched_ = end + 1;
  return without_carriage_return(line);
}

std::optional<std::string_view> LineBuffer::rest() {
  if (begin_ == bytes_.size()) return std::nullopt;
  const auto line = std::string_view(bytes_).substr(begin_);
  begin_ = searched_ = bytes_.size();
  return without_carriage_return(line);
}

void LineBuffer::clear() {
  if (bytes_.capacity() > kKeptBytes) std::string().swap(bytes_);
  bytes_.clear();
  begin_ = searched_ = 0;
}

}  // namespace slsd
