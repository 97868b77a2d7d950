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
  if (has_avx2 && __builtin_cpu_supports("fma")) here.push_back(Clone::kAvx2Fma);
#endif
  return here;
}

std::atomic<Clone> clone_in_use{clones_here().back()};

}  // namespace slsd
