// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/slsctl/recording.hpp"

#include <set>
#include <string>

#include <gmock/gmock.h>

namespace slsd {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<std::string> folders_of(std::initializer_list<const char*> names) {
  json settings{{"cameras", json::array()}};
  for (const char* name : names) settings["cameras"].push_back({{"name", name}});
  std::vector<std::string> folders;
  for (const RecordedCamera& camera : recorded_cameras(settings)) folders.push_back(camera.folder);
  return folders;
}

TEST(RecordedCameras, HaveFoldersOfTheirNames) {
  EXPECT_THAT(folders_of({"left", "right", "über/links"}), ElementsAre("left", "right", "__ber_links"));
}

TEST(RecordedCameras, EachHaveAFolderOfTheirOwn) {
  for (const auto& names : {std::initializer_list<const char*>{"a", "a ", "a_", "a_-1"},
                            {"a b-2", "a_b", "a b"},
                            {"clouds", "", "clouds-0"}}) {
    const std::vector<std::string> folders = folders_of(names);
    EXPECT_EQ(std::set(folders.begin(), folders.end()).size(), names.size());
    EXPECT_THAT(folders, testing::Each(testing::AllOf(testing::Ne("clouds"), testing::Ne(""))));
  }
}

TEST(ReplayConfiguration, BearsTheSkewOfFiles) {
  EXPECT_THAT(replay_configuration(json::object(), {}), HasSubstr("\n[scan]\nexposure_skew_ms = 10000\n"));
}

}  // namespace
}  // namespace slsd
