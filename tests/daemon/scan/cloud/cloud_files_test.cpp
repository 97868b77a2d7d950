// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/cloud/cloud_files.hpp"

#include <unistd.h>

#include <string>

#include <gmock/gmock.h>

namespace slsd {
namespace {

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
