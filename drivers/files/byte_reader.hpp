// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace slsd {

/// Reads unsigned numbers at any offset of a file's bytes; nothing if they lie outside.
/// @thread reentrant
class ByteReader {
 public:
  ByteReader(std::string_view bytes, std::endian order) : bytes_(bytes), order_(order) {}

  [[nodiscard]] std::uint64_t size() const { return bytes_.size(); }
  [[nodiscard]] std::optional<std::uint32_t> u16(std::uint64_t offset) const { return number(offset, 2); }
  [[nodiscard]] std::optional<std::uint32_t> u32(std::uint64_t offset) const { return number(offset, 4); }
  [[nodiscard]] std::optional<std::uint32_t> u8(std::uint64_t offset) const { return number(offset, 1); }

 private:
  [[nodiscard]] std::optional<std::uint32_t> number(std::uint64_t offset, unsigned count) const {
    if (offset > bytes_.size() || bytes_.size() - offset < count) return std::nullopt;
    std::uint32_t value = 0;
    for (unsigned i = 0; i < count; ++i) {
      const unsigned place = order_ == std::endian::big ? count - 1 - i : i;
      value |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes_[offset + i])) << (8 * place);
    }
    return value;
  }

  std::string_view bytes_;
  std::endian order_;
};

}  // namespace slsd
