// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/clones.hpp"

namespace slsd {

std::vector<Clone> clones_here() {
  std::vector<Clone> here{Clone::kPlain};
#if defined(__x86_64__)
  __builtin_cpu_init();
  const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") &&
                        __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("popcnt");
  if (has_avx2) here.push_back(Clone::kAvx2);
  const bool has_fma = has_avx2 && __builtin_cpu_supports("fma");
  if (has_fma) here.push_back(Clone::kAvx2Fma);
  // No loop uses VBMI2. Intel's processors without it (Skylake, Cascade Lake) slow down while they use wide registers.
  if (has_fma && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vbmi2")) {
    here.push_back(Clone::kAvx512);
  }
#endif
  return here;
}

std::atomic<Clone> clone_in_use{clones_here().back()};

}  // namespace slsd
