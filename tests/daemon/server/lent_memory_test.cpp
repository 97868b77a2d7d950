// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/lent_memory.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <string>
#include <vector>

#include <gmock/gmock.h>

namespace slsd {
namespace {

constexpr std::size_t kLentBytes = 1 << 20;

TEST(SealedMemory, HoldsTheBytesAndCannotChange) {
  const auto memory = sealed_memory("a cloud");
  ASSERT_TRUE(memory);
  const int number = memory->given.number();
  std::string bytes(7, '\0');
  EXPECT_EQ(::read(number, bytes.data(), bytes.size()), 7);
  EXPECT_EQ(bytes, "a cloud");
  EXPECT_EQ(::fcntl(number, F_GET_SEALS), F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE | F_SEAL_SEAL);
  EXPECT_LT(::write(number, "x", 1), 0);
  EXPECT_NE(::ftruncate(number, 0), 0);
}

TEST(SealedMemory, SaysThatNoDescriptorIsLeft) {
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  const rlimit few{3, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &few), 0);
  const auto memory = sealed_memory("a cloud");
  ::setrlimit(RLIMIT_NOFILE, &before);
  ASSERT_FALSE(memory);
  EXPECT_EQ(memory.error().code, ErrorCode::kNoSpace);
}

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
