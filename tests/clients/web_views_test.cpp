// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/web/view_folder.hpp"

#include <cstdlib>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

#include "drivers/files/file.hpp"

namespace slsd::web {
namespace {

using std::filesystem::path;
using testing::ElementsAre;
using testing::IsEmpty;

class ViewFolder : public testing::Test {
 protected:
  ViewFolder() {
    std::string name = testing::TempDir() + "slsd-views-XXXXXX";
    if (mkdtemp(name.data()) == nullptr) std::abort();
    folder_ = name;
    write("poses.csv", "# of the cell\npose_00,0.5,-2,3e2,4,5,6\npose_01,1,2,3,4,5,6.25\n");
    write("pose_00/white.png", "one");
    write("pose_01/left/white.png", "left");
    write("pose_01/right/white.png", "right");
    write("secret/white.png", "secret");
  }
  ~ViewFolder() override { std::filesystem::remove_all(folder_); }

  void write(const path& name, const std::string& text) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
  }
  std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const KeptView& view : views_in(folder_)) names.push_back(view.name);
    return names;
  }

  path folder_;
};

TEST_F(ViewFolder, ListsTheViewsWithTheirPoses) {
  EXPECT_THAT(names(), ElementsAre("pose_00", "pose_01"));
  EXPECT_THAT(views_in(folder_)[0].pose, ElementsAre(0.5, -2, 300, 4, 5, 6));
  EXPECT_THAT(views_in(folder_ / "nowhere"), IsEmpty());
}

TEST_F(ViewFolder, SkipsLinesThatNameOtherFolders) {
  write("poses.csv", "../secret,1\nsecret,1\npose_,1\npose_1a,1\npose_02,1,two\npose_03,1,\n\npose_04,7\npose_05,1");
  EXPECT_THAT(names(), ElementsAre("pose_04", "pose_05"));
}

TEST_F(ViewFolder, ErasesAViewAndKeepsTheOthers) {
  ASSERT_TRUE(erase_view(folder_, "pose_00"));
  EXPECT_THAT(names(), ElementsAre("pose_01"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "pose_00"));
  EXPECT_EQ(read_file(folder_ / "poses.csv", 1000).value(), "# of the cell\npose_01,1,2,3,4,5,6.25\n");
  ASSERT_TRUE(erase_view(folder_, "pose_01"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "poses.csv"));
}

TEST_F(ViewFolder, ErasesNothingElse) {
  for (const char* name : {"secret", "", ".", "..", "../secret", "pose_02", "pose_00/../secret", "# of the cell"}) {
    const auto erased = erase_view(folder_, name);
    ASSERT_FALSE(erased) << name;
    EXPECT_EQ(erased.error().code, ErrorCode::kNotFound);
  }
  EXPECT_THAT(names(), ElementsAre("pose_00", "pose_01"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "secret/white.png"));
}

TEST_F(ViewFolder, ReadsThePictureOfEachCamera) {
  EXPECT_THAT(cameras_of_view(folder_, "pose_00"), ElementsAre(""));
  EXPECT_THAT(cameras_of_view(folder_, "pose_01"), ElementsAre("left", "right"));
  EXPECT_EQ(picture_of_view(folder_, "pose_00", "").value(), "one");
  EXPECT_EQ(picture_of_view(folder_, "pose_01", "right").value(), "right");
  const std::vector<std::pair<std::string, std::string>> others = {
      {"pose_01", ""}, {"pose_01", "../../secret"}, {"secret", ""}, {"../x", ""}};
  for (const auto& [view, camera] : others)
    EXPECT_FALSE(picture_of_view(folder_, view, camera)) << view << " " << camera;
}

}  // namespace
}  // namespace slsd::web
