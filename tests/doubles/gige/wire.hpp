// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace slsd::test {

/// Writes the big-endian fields of GVCP and GVSP one after another.
class WireWriter {
 public:
  explicit WireWriter(std::vector<std::uint8_t>& bytes) : bytes_(bytes) { bytes_.clear(); }

  WireWriter& u8(std::uint32_t value) {
    bytes_.push_back(static_cast<std::uint8_t>(value));
    return *this;
  }
  WireWriter& u16(std::uint32_t value) { return u8(value >> 8).u8(value); }
  WireWriter& u24(std::uint32_t value) { return u8(value >> 16).u16(value); }
  WireWriter& u32(std::uint32_t value) { return u16(value >> 16).u16(value); }
  WireWriter& zeros(std::size_t count) {
    bytes_.insert(bytes_.end(), count, 0);
    return *this;
  }
  WireWriter& bytes(std::span<const std::uint8_t> more) {
    bytes_.insert(bytes_.end(), more.begin(), more.end());
    return *this;
  }

 private:
  std::vector<std::uint8_t>& bytes_;
};

/// Reads big-endian fields; past the end they are zero.
class WireReader {
 public:
  explicit WireReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  std::uint32_t u8() {
    if (bytes_.empty()) return 0;
    const std::uint32_t value = bytes_.front();
    bytes_ = bytes_.subspan(1);
    return value;
  }
  std::uint32_t u16() {
    const std::uint32_t high = u8();
    return high << 8 | u8();
  }
  std::uint32_t u32() {
    const std::uint32_t high = u16();
    return high << 16 | u16();
  }
  [[nodiscard]] std::span<const std::uint8_t> rest() const { return bytes_; }

 private:
  std::span<const std::uint8_t> bytes_;
};

}  // namespace slsd::test
