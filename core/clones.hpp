// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

namespace slsd {

/// Instruction sets for which core's inner loops are compiled. One package serves all machines of an architecture: it
/// contains each loop several times, and chooses at run time. On arm64 the plain code is NEON, which all of these
/// machines have.
enum class Clone : std::uint8_t {
  kPlain,    ///< the architecture's minimum: SSE2, NEON
  kAvx2,     ///< the same results as kPlain
  kAvx2Fma,  ///< the same except for rounding, as products are not rounded before the addition
  kAvx512,   ///< as kAvx2Fma, with twice the registers
};

/// Lists the clones that this machine can run, the plain one first and the fastest last.
[[nodiscard]] std::vector<Clone> clones_here();

/// Clone in use: the fastest, unless a test selects another. Core's only variable.
extern std::atomic<Clone> clone_in_use;

/// A loop that is compiled once for each clone: Cloned<body>::call(...) calls the clone in use.
/// @param kBody  an always_inline function, inlined into each clone. Its parameters are numbers, pointers, references
///               and spans: the calling convention for vectors differs between clones
template <auto kBody>
struct Cloned;

template <class Result, class... Parameters, Result (*kBody)(Parameters...)>
struct Cloned<kBody> {
  static Result call(Parameters... parameters) {
#if defined(__x86_64__)
    switch (clone_in_use.load(std::memory_order_relaxed)) {
      case Clone::kAvx512:
        return avx512(parameters...);
      case Clone::kAvx2Fma:
        return avx2_fma(parameters...);
      case Clone::kAvx2:
        return avx2(parameters...);
      case Clone::kPlain:
        break;
    }
#endif
    return plain(parameters...);
  }

 private:
  [[gnu::noinline]] static Result plain(Parameters... parameters) {
    return kBody(parameters...);
  }
#if defined(__x86_64__)
  __attribute__((noinline, target("avx2,bmi,bmi2,popcnt"))) static Result avx2(Parameters... parameters) {
    return kBody(parameters...);
  }
  __attribute__((noinline, target("avx2,bmi,bmi2,popcnt,fma"))) static Result avx2_fma(Parameters... parameters) {
    return kBody(parameters...);
  }
  __attribute__((noinline, target("avx512f,avx512vl,avx512bw,avx512dq,avx2,bmi,bmi2,popcnt,fma"))) static Result avx512(
      Parameters... parameters) {
    return kBody(parameters...);
  }
#endif
};

/// A loop whose results are the same on all processors of an architecture, to the last bit: on x86, no clone fuses
/// products.
/// @param kWide, kNarrow  the loop in vectors of eight, for processors with AVX2, and in vectors of four
template <auto kWide, auto kNarrow>
struct ClonedExactly;

template <class... Parameters, void (*kWide)(Parameters...), void (*kNarrow)(Parameters...)>
struct ClonedExactly<kWide, kNarrow> {
  static void call(Parameters... parameters) {
#if defined(__x86_64__)
    if (clone_in_use.load(std::memory_order_relaxed) != Clone::kPlain) return avx2(parameters...);
#endif
    kNarrow(parameters...);
  }

#if defined(__x86_64__)
 private:
  __attribute__((noinline, target("avx2,bmi,bmi2,popcnt"))) static void avx2(Parameters... parameters) {
    kWide(parameters...);
  }
#endif
};

}  // namespace slsd
