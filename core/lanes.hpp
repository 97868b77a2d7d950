// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

namespace slsd {

/// Eight numbers computed at once: one register of AVX2, two of SSE2.
inline constexpr int kLanes = 8;
using Lanes [[gnu::vector_size(32)]] = float;
using IntLanes [[gnu::vector_size(32)]] = int;
/// Each lane's number.
inline constexpr Lanes kLane = {0, 1, 2, 3, 4, 5, 6, 7};
inline constexpr IntLanes kIntLane = {0, 1, 2, 3, 4, 5, 6, 7};

/// Four numbers: one register of every processor, for the four directions.
using FourLanes [[gnu::vector_size(16)]] = float;
using FourIntLanes [[gnu::vector_size(16)]] = int;

/// The bits of all lanes combined by or.
static inline __attribute__((always_inline)) unsigned united(const FourIntLanes& lanes) {
  const auto halves = std::bit_cast<std::array<std::uint64_t, 2>>(lanes);
  const std::uint64_t both = halves[0] | halves[1];
  return static_cast<unsigned>(both | both >> 32U);
}
/// One bit for each lane in which a comparison holds.
static inline __attribute__((always_inline)) unsigned bits_of(const FourIntLanes& holds) {
  constexpr FourIntLanes kBits = {1, 2, 4, 8};
  return united(holds & kBits);
}

// Never pass vectors by value between functions that are not inlined: the calling convention depends on the processor.
static inline __attribute__((always_inline)) void load(const float* from, Lanes& to) {
  std::memcpy(&to, from, sizeof to);
}

/// Loads numbers of another type, with conversion.
template <class T>
static inline __attribute__((always_inline)) void load(const T* from, Lanes& to) {
  using Numbers [[gnu::vector_size(kLanes * sizeof(T))]] = T;
  Numbers numbers;
  std::memcpy(&numbers, from, sizeof numbers);
  to = __builtin_convertvector(numbers, Lanes);
}

/// Takes each lane from the lane that `from` names.
static inline __attribute__((always_inline)) void permute(const Lanes& lanes, const IntLanes& from, Lanes& to) {
#if defined(__clang__)
  for (int lane = 0; lane < kLanes; ++lane) to[lane] = lanes[from[lane]];
#else
  to = __builtin_shuffle(lanes, from);
#endif
}

static inline __attribute__((always_inline)) float sum_of(const Lanes& lanes) {
  using Half [[gnu::vector_size(16)]] = float;
  const Half half =
      __builtin_shufflevector(lanes, lanes, 0, 1, 2, 3) + __builtin_shufflevector(lanes, lanes, 4, 5, 6, 7);
  const Half quarter = half + __builtin_shufflevector(half, half, 2, 3, 0, 1);
  return quarter[0] + quarter[1];
}

}  // namespace slsd
