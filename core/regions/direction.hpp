// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>

namespace slsd {

/// Directions of the grid's links, along the pattern's axes: u to the right, v down.
enum Direction : std::uint8_t { kRight, kDown, kLeft, kUp };

/// All four. Computed rather than stored, so that the compiler unrolls loops over them.
struct Directions {
  class Iterator {
   public:
    using difference_type = std::ptrdiff_t;
    using value_type = Direction;
    constexpr Iterator() = default;
    constexpr explicit Iterator(int count) : count_(count) {}
    constexpr Direction operator*() const { return static_cast<Direction>(count_); }
    constexpr Iterator& operator++() {
      ++count_;
      return *this;
    }
    constexpr Iterator operator++(int) { return Iterator(count_++); }
    constexpr bool operator==(const Iterator&) const = default;

   private:
    int count_ = 0;
  };
  [[nodiscard]] static constexpr Iterator begin() { return Iterator(kRight); }
  [[nodiscard]] static constexpr Iterator end() { return Iterator(kUp + 1); }
};
inline constexpr Directions kDirections;

}  // namespace slsd
