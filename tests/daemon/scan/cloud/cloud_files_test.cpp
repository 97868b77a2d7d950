// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/cloud/cloud_files.hpp"

#include <fcntl.h>
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

constexpr CloudForm kPixels{CloudFormat::kPly, Density::kPixels};

Cloud one_point() {
  Cloud cloud;
  cloud.scan_id = "a-1";
  cloud.points.push_back({.x = 1, .y = 2, .z = 3});
  return cloud;
}

std::string content(const SealedMemory& memory) {
  std::string bytes(memory.bytes, '\0');
  EXPECT_EQ(::pread(memory.given.number(), bytes.data(), bytes.size(), 0), static_cast<ssize_t>(bytes.size()));
  return bytes;
}

TEST(CloudFormats, TwoWhoWantAMemfdShareTheBytesOfTheSecond) {
  const CloudFormats one = CloudFormats::only_memory(kPixels);
  EXPECT_TRUE(one.dense());
  EXPECT_FALSE(one.has(kPixels));
  EXPECT_TRUE((one | CloudFormats{}).has_memory(kPixels));
  EXPECT_FALSE((one | CloudFormats{}).has(kPixels));
  EXPECT_TRUE((one | one).has_memory(kPixels));
  EXPECT_TRUE((one | one).has(kPixels));
  EXPECT_TRUE((one | CloudFormats::only(kPixels)).has(kPixels));
}

TEST(CloudFiles, GiveEachClientAMemfdOfItsOwn) {
  const Cloud cloud = one_point();
  CloudFiles files(cloud, nullptr, CloudFormats::only_memory({}));
  CloudFiles copy = files;
  const auto first = files.memory(cloud, nullptr, {}), second = copy.memory(cloud, nullptr, {});
  ASSERT_TRUE(first && second);
  EXPECT_NE(first->given.number(), second->given.number());
  EXPECT_EQ(content(*first), *files.file(cloud, nullptr, {}));
  EXPECT_EQ(content(*second), content(*first));
}

TEST(CloudFiles, CountAMemfdUntilItIsGiven) {
  const Cloud cloud = one_point();
  CloudFiles files(cloud, nullptr, CloudFormats::only_memory({}));
  const std::size_t bytes = files.bytes();
  EXPECT_GT(bytes, 0U);
  const auto memory = files.memory(cloud, nullptr, {});
  ASSERT_TRUE(memory);
  EXPECT_EQ(memory->bytes, bytes);
  EXPECT_EQ(files.bytes(), 0U);
}

}  // namespace
}  // namespace slsd
