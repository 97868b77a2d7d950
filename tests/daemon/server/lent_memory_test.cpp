// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/lent_memory.hpp"

#include <sys/mman.h>

#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "drivers/system/sealed_memory.hpp"

namespace slsd {
namespace {

constexpr std::size_t kLentBytes = 1 << 20;

TEST(LentMemory, CountsUntilTheClientClosedAndUnmapped) {
  MemoryBudget budget(100 * kLentBytes);
  LentMemory lent(budget);
  auto memory = sealed_memory(std::string(kLentBytes, 'c'));
  ASSERT_TRUE(memory);
  ASSERT_TRUE(lent.add(std::move(memory->kept), memory->bytes));
  lent.sweep();
  EXPECT_EQ(budget.held(), kLentBytes);
  void* mapped = ::mmap(nullptr, kLentBytes, PROT_READ, MAP_SHARED, memory->given.number(), 0);
  ASSERT_NE(mapped, MAP_FAILED);
  memory->given = FileDescriptor();
  lent.sweep();
  EXPECT_EQ(budget.held(), kLentBytes) << "mapped still";
  ::munmap(mapped, kLentBytes);
  lent.sweep();
  EXPECT_EQ(budget.held(), 0U);
  EXPECT_EQ(lent.count(), 0U);
}

TEST(LentMemory, LendsNoMoreThanAHalf) {
  MemoryBudget budget(16 * kLentBytes);
  LentMemory lent(budget);
  std::vector<FileDescriptor> given;
  Result<> added;
  while (added && given.size() < 20) {
    auto memory = sealed_memory(std::string(kLentBytes, 'c'));
    ASSERT_TRUE(memory);
    added = lent.add(std::move(memory->kept), memory->bytes);
    given.push_back(std::move(memory->given));
  }
  ASSERT_FALSE(added);
  EXPECT_EQ(added.error().code, ErrorCode::kBusy);
  EXPECT_EQ(given.size(), 9U);
  given.clear();
  lent.sweep();
  EXPECT_EQ(budget.lent(), 0U);
}

}  // namespace
}  // namespace slsd
