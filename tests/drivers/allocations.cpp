// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/drivers/allocations.hpp"

#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <fstream>
#include <new>

namespace {
std::atomic<std::uint64_t> count{0}, bytes{0};
}

namespace slsd::test {
std::uint64_t allocations() {
  return count.load();
}

std::uint64_t allocated_bytes() {
  return bytes.load();
}

double resident_mib() {
  long total = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> total >> resident;
  return static_cast<double>(resident * ::sysconf(_SC_PAGESIZE)) / (1 << 20);
}
}  // namespace slsd::test

#if !defined(__SANITIZE_THREAD__)  // whose own cannot be replaced: there nothing is counted
void* operator new(std::size_t size) {
  ++count;
  bytes += size;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++count;
  bytes += size;
  return std::malloc(size == 0 ? 1 : size);
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
#endif
