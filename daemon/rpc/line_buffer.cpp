// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/rpc/line_buffer.hpp"

#include <utility>

namespace slsd {
namespace {

void cut_carriage_return(std::string& line) {
  if (!line.empty() && line.back() == '\r') line.pop_back();
}

}  // namespace

std::optional<std::string> LineBuffer::next_line() {
  const std::size_t end = bytes_.find('\n', searched_);
  if (end == std::string::npos || end > limit_bytes_) {
    searched_ = bytes_.size();
    return std::nullopt;
  }
  std::string line = bytes_.substr(0, end);
  bytes_.erase(0, end + 1);
  searched_ = 0;
  if (bytes_.empty() && bytes_.capacity() > 65536) bytes_.shrink_to_fit();
  cut_carriage_return(line);
  return line;
}

std::optional<std::string> LineBuffer::rest() {
  if (bytes_.empty()) return std::nullopt;
  searched_ = 0;
  std::string line = std::exchange(bytes_, {});
  cut_carriage_return(line);
  return line;
}

}  // namespace slsd
