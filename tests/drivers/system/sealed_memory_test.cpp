// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/system/sealed_memory.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <string>

#include <gmock/gmock.h>

namespace slsd {
namespace {

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

TEST(SealedMemory, JoinsPieces) {
  const auto memory = sealed_memory([](ByteSink& sink) {
    sink.take("a ");
    sink.take("cloud");
  });
  ASSERT_TRUE(memory);
  std::string bytes(8, '\0');
  EXPECT_EQ(::read(memory->given.number(), bytes.data(), bytes.size()), 7);
  EXPECT_EQ(memory->bytes, 7U);
}

// A file size limit takes the place of a full memory.
TEST(SealedMemory, SaysThatNoMemoryIsLeft) {
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit few{1000, before.rlim_max};
  const auto ignored = std::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &few), 0);
  const auto memory = sealed_memory(std::string(2000, 'c'));
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, ignored);
  EXPECT_FALSE(memory);
}

TEST(SealedMemory, IsHeldUntilItIsClosedAndUnmapped) {
  auto memory = sealed_memory("a cloud");
  ASSERT_TRUE(memory);
  EXPECT_TRUE(is_held_by_others(memory->kept));
  void* const mapped = ::mmap(nullptr, memory->bytes, PROT_READ, MAP_SHARED, memory->given.number(), 0);
  ASSERT_NE(mapped, MAP_FAILED);
  memory->given = FileDescriptor();
  EXPECT_TRUE(is_held_by_others(memory->kept));
  ::munmap(mapped, memory->bytes);
  EXPECT_FALSE(is_held_by_others(memory->kept));
}

}  // namespace
}  // namespace slsd
