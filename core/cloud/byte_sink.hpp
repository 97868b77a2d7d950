// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace slsd {

/// Takes a file piece by piece, in order.
class ByteSink {
 public:
  virtual ~ByteSink() = default;
  /// Announces the size of the whole file, before its first piece.
  virtual void expect(std::size_t bytes) = 0;
  virtual void take(std::string_view piece) = 0;
};

/// Collects the file in a string.
class StringSink final : public ByteSink {
 public:
  void expect(std::size_t bytes) override { bytes_.reserve(bytes); }
  void take(std::string_view piece) override { bytes_.append(piece); }
  [[nodiscard]] std::string& bytes() { return bytes_; }

 private:
  std::string bytes_;
};

}  // namespace slsd
