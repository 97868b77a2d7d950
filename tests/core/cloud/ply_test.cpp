// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/cloud/ply.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/core/cloud/any_cloud.hpp"

namespace slsd {
namespace {

using ::testing::HasSubstr;

RC_GTEST_PROP(ReadPly, ReturnsWhatWasWritten, (std::uint32_t seed)) {
  const Cloud cloud = any_cloud(seed, *rc::gen::inRange(1, 20), *rc::gen::inRange(1, 20));
  const auto read = read_ply(write_ply(cloud), "cloud.ply");
  RC_ASSERT(read.has_value());
  RC_ASSERT(*read == cloud);
}

TEST(WritePly, SaysTheContract) {
  const std::string text = write_ply(any_cloud(7, 3, 2));
  EXPECT_EQ(text.substr(0, text.find("comment frame")),
            "ply\nformat binary_little_endian 1.0\ncomment scan_id scan-7\ncomment time 2026-03-01T12:00:00.000Z\n");
  EXPECT_THAT(text, HasSubstr("property float x\nproperty float y\nproperty float z\nproperty uchar intensity\n"
                              "property float camera_u\nproperty float camera_v\nproperty float projector_u\n"
                              "property float projector_v\nproperty uchar camera\nproperty uchar symbol\n"
                              "property float sigma_mm\nproperty int column\nproperty int row\nend_header\n"));
}

TEST(WritePly, KeepsAnIdFromBreakingTheHeader) {
  Cloud cloud = any_cloud(7, 3, 2);
  cloud.scan_id = "one\nelement vertex 99";
  const auto read = read_ply(write_ply(cloud), "cloud.ply");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->scan_id, "one element vertex 99");
}

TEST(ReadPly, RefusesEveryTruncation) {
  const std::string whole = write_ply(any_cloud(3, 4, 4));
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto read = read_ply(whole.substr(0, size), "cloud.ply");
    ASSERT_FALSE(read) << size;
    EXPECT_EQ(read.error().code, ErrorCode::kMalformed);
    EXPECT_EQ(read.error().where, "cloud.ply");
  }
  EXPECT_FALSE(read_ply(whole + "x", "cloud.ply"));
}

TEST(ReadPly, RefusesACellThatIsNone) {
  std::string text = write_ply(any_cloud(3, 4, 4));
  text.back() = '\x80';
  EXPECT_THAT(to_string(read_ply(text, "cloud.ply").error()), HasSubstr("cloud.ply: has no valid cell in point"));
}

TEST(ReadPly, RefusesACountThatWouldOverflow) {
  std::string text = write_ply({});
  text.replace(text.find("vertex 0"), 8, "vertex 18446744073709551615");
  EXPECT_THAT(to_string(read_ply(text, "cloud.ply").error()), HasSubstr("element vertex"));
}

}  // namespace
}  // namespace slsd
