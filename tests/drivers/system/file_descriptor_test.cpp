// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/system/file_descriptor.hpp"

#include <fcntl.h>

#include <utility>

#include <gtest/gtest.h>

namespace slsd {
namespace {

FileDescriptor open_something() {
  return FileDescriptor(::open("/dev/null", O_RDWR | O_CLOEXEC));
}

bool is_open(int number) {
  return ::fcntl(number, F_GETFD) >= 0;
}

TEST(FileDescriptor, ClosesAtTheEnd) {
  int number = -1;
  {
    const FileDescriptor file = open_something();
    ASSERT_TRUE(file);
    number = file.number();
    EXPECT_TRUE(is_open(number));
  }
  EXPECT_FALSE(is_open(number));
}

TEST(FileDescriptor, ClosesWhatAnotherTakesThePlaceOf) {
  FileDescriptor file = open_something();
  const int before = file.number();
  FileDescriptor other = open_something();
  const int after = other.number();
  file = std::move(other);
  EXPECT_FALSE(is_open(before));
  EXPECT_EQ(file.number(), after);
  EXPECT_TRUE(is_open(after));
}

TEST(FileDescriptor, TellsWhyClosingFailed) {
  FileDescriptor file(1 << 20);
  EXPECT_EQ(file.close(), EBADF);
  EXPECT_EQ(file.close(), 0);
  EXPECT_FALSE(file);
}

TEST(FileDescriptor, LeavesErrnoToTheCallBefore) {
  errno = ENOSPC;
  { const FileDescriptor file(1 << 20); }
  EXPECT_EQ(errno, ENOSPC);
}

}  // namespace
}  // namespace slsd
