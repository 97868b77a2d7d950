// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/cloud/ply.hpp"

#include <cstring>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/core/cloud/any_cloud.hpp"

namespace slsd {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;

constexpr char kColourLines[] = "property uchar red\nproperty uchar green\nproperty uchar blue\n";

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

TEST(WritePly, EndsRecordsWithTheColour) {
  Cloud cloud = any_cloud(9, 3, 2);
  cloud.points.resize(1);
  cloud.points.front().colour = {1, 2, 3};
  const std::string text = write_ply(cloud);
  EXPECT_THAT(text, HasSubstr("\nproperty int row\n" + std::string(kColourLines) + "end_header\n"));
  EXPECT_THAT(text, EndsWith("\1\2\3"));
  cloud.coloured = false;
  EXPECT_EQ(write_ply(cloud).size() + 3 + sizeof kColourLines - 1, text.size());
}

TEST(WritePly, KeepsAnIdFromBreakingTheHeader) {
  Cloud cloud = any_cloud(7, 3, 2);
  cloud.scan_id = "one\nelement vertex 99";
  const auto read = read_ply(write_ply(cloud), "cloud.ply");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->scan_id, "one element vertex 99");
}

// x, y and z turned into each other, so that every number is exact.
const RigidTransform kBaseFromRig{(Eigen::Matrix3d() << 0, 0, 1, 1, 0, 0, 0, 1, 0).finished(), {1000, -200.5, 30}};

TEST(WritePly, TakesPointsIntoTheRobotsBase) {
  const Cloud cloud = any_cloud(7, 3, 2);
  ASSERT_FALSE(cloud.points.empty());
  const std::string text = write_ply(cloud, &kBaseFromRig);
  EXPECT_THAT(text, HasSubstr("\ncomment coordinate_frame robot_base: the robot's\n"
                              "comment base_from_rig 0 0 1 1000 1 0 0 -200.5 0 1 0 30\n"));
  const std::size_t end = text.find("end_header\n") + 11;
  float first[3];
  std::memcpy(first, text.data() + end, sizeof first);
  const CloudPoint& point = cloud.points.front();
  EXPECT_FLOAT_EQ(first[0], point.z + 1000);
  EXPECT_FLOAT_EQ(first[1], point.x - 200.5F);
  EXPECT_FLOAT_EQ(first[2], point.y + 30);
}

TEST(ReadPly, TakesPointsOfTheRobotsBaseBackToTheRig) {
  const Cloud cloud = any_cloud(7, 3, 2);
  const auto read = read_ply(write_ply(cloud, &kBaseFromRig), "cloud.ply");
  ASSERT_TRUE(read) << to_string(read.error());
  ASSERT_EQ(read->points.size(), cloud.points.size());
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    EXPECT_NEAR(read->points[i].x, cloud.points[i].x, 1e-3);
    EXPECT_NEAR(read->points[i].y, cloud.points[i].y, 1e-3);
    EXPECT_NEAR(read->points[i].z, cloud.points[i].z, 1e-3);
    EXPECT_EQ(read->points[i].camera_u, cloud.points[i].camera_u);
  }
  for (const char* wrong :
       {"base_from_rig 0 0 1 1000 1 0 0 -200.5 0 1 0", "base_from_rig 0 0 nan 1000 1 0 0 1 0 1 0 30"}) {
    std::string text = write_ply(cloud, &kBaseFromRig);
    const std::size_t at = text.find("base_from_rig");
    text.replace(at, text.find('\n', at) - at, wrong);
    EXPECT_FALSE(read_ply(text, "cloud.ply")) << wrong;
  }
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
  std::string text = write_ply(any_cloud(4, 4, 4));
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
