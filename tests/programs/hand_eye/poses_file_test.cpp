// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/hand_eye/poses_file.hpp"

#include <cmath>

#include <gmock/gmock.h>

namespace slsd {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(ReadPoses, ReadsLinesWithAnySeparator) {
  const auto poses = read_poses(
      "capture;x;y;z\r\n# by hand\n\npose_00, 1, -2.5, +3e2\r\npose_01\t4 5 6\npose_02;[7;8;9]\npose_03,nan,0,0",
      "poses.csv");
  ASSERT_TRUE(poses) << to_string(poses.error());
  ASSERT_EQ(poses->size(), 4U);
  EXPECT_EQ((*poses)[0].name, "pose_00");
  EXPECT_THAT((*poses)[0].numbers, ElementsAre(1, -2.5, 300));
  EXPECT_THAT((*poses)[1].numbers, ElementsAre(4, 5, 6));
  EXPECT_THAT((*poses)[2].numbers, ElementsAre(7, 8, 9));
  EXPECT_TRUE(std::isnan((*poses)[3].numbers[0]));
}

TEST(ReadPoses, PassesOverTheByteOrderMarkOfSpreadsheets) {
  const auto poses = read_poses("\xef\xbb\xbfpose_00,1,2,3\r\npose_01,4,5,6\r\n", "poses.csv");
  ASSERT_TRUE(poses) << to_string(poses.error());
  EXPECT_EQ((*poses)[0].name, "pose_00");
  EXPECT_THAT((*poses)[1].numbers, ElementsAre(4, 5, 6));
}

TEST(ReadPoses, NamesTheLineThatIsWrong) {
  const auto message = [](const char* text) {
    const auto poses = read_poses(text, "poses.csv");
    return poses ? std::string("no error") : to_string(poses.error());
  };
  EXPECT_THAT(message("pose_00,1,2\npose_01,1,two\n"), HasSubstr("poses.csv:2: two is not a number"));
  EXPECT_THAT(message("pose_00,1l,2\npose_01,1,2\n"), HasSubstr("poses.csv:1: 1l is not a number"));
  EXPECT_THAT(message("pose_00,1,2\npose_00,1,2\n"), HasSubstr("poses.csv:2: pose_00 is given twice"));
  EXPECT_THAT(message("# nothing\n"), HasSubstr("has no pose"));
}

}  // namespace
}  // namespace slsd
