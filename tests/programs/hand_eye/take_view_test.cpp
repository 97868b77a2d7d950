// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/hand_eye/take_view.hpp"

#include <cstdlib>
#include <limits>

#include <gmock/gmock.h>

#include "drivers/files/file.hpp"

namespace slsd {
namespace {

using testing::HasSubstr;

class StillSource final : public PoseSource {
 public:
  [[nodiscard]] const std::vector<std::string>& cameras() const override { return names; }
  [[nodiscard]] ImageSize projector() const override { return {64, 40}; }
  void show(const Grey8& image) override { white_ = image.at(0, 0) == 255; }
  [[nodiscard]] Result<std::vector<GreyImage>> grab() override {
    if (fails || !white_) return fail(ErrorCode::kTimeout, "no frame");
    return std::vector<GreyImage>(names.size(), Grey8(32, 24, 200));
  }
  bool fails = false;
  std::vector<std::string> names{"camera"};

 private:
  bool white_ = false;
};

class TakeView : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = testing::TempDir() + "slsd-view-XXXXXX";
    if (mkdtemp(name.data()) == nullptr) std::abort();
    folder_ = std::filesystem::path(name) / "captures";
  }
  void TearDown() override { std::filesystem::remove_all(folder_.parent_path()); }
  Result<TakenView> take(const std::vector<double>& pose) {
    return take_view(source_, folder_, pose, *pose_notation("kuka"));
  }
  [[nodiscard]] std::string lines() const { return read_file(folder_ / "poses.csv", 1 << 20).value_or("none"); }

  std::filesystem::path folder_;
  StillSource source_;
};

TEST_F(TakeView, AddsPictureAndPose) {
  ASSERT_TRUE(take({1, 2, 3, 40, 50, 60.25}));
  const auto second = take({-1, 2, 3, 40, 50, 60});
  ASSERT_TRUE(second);
  EXPECT_EQ(second->name, "pose_01");
  EXPECT_EQ(lines(), "pose_00,1,2,3,40,50,60.25\npose_01,-1,2,3,40,50,60\n");
  EXPECT_TRUE(std::filesystem::is_regular_file(folder_ / "pose_01/white.png"));
}

TEST_F(TakeView, IsDroppedWithoutATrace) {
  const auto first = take({1, 2, 3, 40, 50, 60});
  ASSERT_TRUE(first);
  const std::string before = lines();
  const auto second = take({-1, 2, 3, 40, 50, 60});
  ASSERT_TRUE(second);
  ASSERT_TRUE(drop_view(folder_, *second));
  EXPECT_EQ(lines(), before);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "pose_01"));
  ASSERT_TRUE(drop_view(folder_, *first));
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(TakeView, OfSeveralCamerasHasAFolderForEach) {
  source_.names = {"left", "right eye"};
  ASSERT_TRUE(take({1, 2, 3, 40, 50, 60}));
  EXPECT_TRUE(std::filesystem::is_regular_file(folder_ / "pose_00/left/white.png"));
  EXPECT_TRUE(std::filesystem::is_regular_file(folder_ / "pose_00/right eye/white.png"));
}

TEST_F(TakeView, RefusesACameraWhoseNameIsNoFolder) {
  for (const char* name : {"../right", "a/b", "..", "."}) {
    source_.names = {"left", name};
    const auto wrong = take({1, 2, 3, 40, 50, 60});
    ASSERT_FALSE(wrong) << name;
    EXPECT_THAT(to_string(wrong.error()),
                HasSubstr(std::string("camera ") + name + ": cannot be the name of a folder"));
    EXPECT_FALSE(std::filesystem::exists(folder_));
  }
  source_.names = {"../right"};  // alone, its pictures need no folder of their own
  EXPECT_TRUE(take({1, 2, 3, 40, 50, 60}));
}

TEST_F(TakeView, ChangesNothingOnBadInput) {
  const auto wrong = take({1, 2, 3, 4, 5, std::numeric_limits<double>::quiet_NaN()});
  ASSERT_FALSE(wrong);
  EXPECT_THAT(to_string(wrong.error()), HasSubstr("--pose: has a number that is not finite"));
  EXPECT_FALSE(take({1, 2, 3}));
  source_.fails = true;
  EXPECT_FALSE(take({1, 2, 3, 4, 5, 6}));
  EXPECT_FALSE(std::filesystem::exists(folder_));
}

TEST_F(TakeView, KeepsAFileThatIsNoFileOfPoses) {
  std::filesystem::create_directories(folder_);
  ASSERT_TRUE(write_file_atomically(folder_ / "poses.csv", "pose_00,1,2,x\n"));
  const auto refused = take({1, 2, 3, 4, 5, 6});
  ASSERT_FALSE(refused);
  EXPECT_THAT(to_string(refused.error()), HasSubstr("poses.csv:1: x is not a number"));
  EXPECT_EQ(lines(), "pose_00,1,2,x\n");
}

}  // namespace
}  // namespace slsd
