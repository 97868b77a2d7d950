// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/commands/device_list.hpp"

#include <gmock/gmock.h>

namespace slsd {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

ListedCamera gige_camera() {
  ListedCamera camera;
  camera.standard = "GigE Vision";
  camera.driver = "aravis";
  camera.name = "Maker-S77";
  camera.serial = "S77";
  camera.address = "10.0.0.7";
  camera.interface = "eth1 (10.0.0.1/24)";
  camera.link_mbps = 1000;
  camera.formats = {{"Mono8", {{1600, 1200}}}};
  return camera;
}

CameraOptions configured(const std::string& id) {
  AravisCameraOptions options;
  options.name = "left";
  options.id = id;
  return {options, {}};
}

TEST(CameraList, KnowsAnAravisCameraByEachOfItsNames) {
  for (const char* id : {"Maker-S77", "S77", "10.0.0.7"}) EXPECT_TRUE(names(configured(id), gige_camera())) << id;
  EXPECT_FALSE(names(configured("S7"), gige_camera()));
  CameraOptions file;
  EXPECT_FALSE(names(file, gige_camera()));
}

TEST(CameraList, TellsWhatIsSeenAndWhatIsConfigured) {
  Configuration configuration;
  configuration.cameras = {configured("S77"), configured("S78")};
  const CameraList list(configuration, {{gige_camera()}, {}});
  EXPECT_THAT(list.text(), HasSubstr("camera Maker-S77\n    GigE Vision, serial S77\n    at 10.0.0.7 through eth1 "
                                     "(10.0.0.1/24), link of 1000 Mbit/s\n    formats: Mono8 1600x1200\n    configured "
                                     "as \"left\"\nconfigured camera \"left\", driver aravis: is not found\n"));
  const nlohmann::json json = list.json();
  EXPECT_EQ(json["cameras"][0]["configured_as"], "left");
  EXPECT_EQ(json["cameras"][0]["formats"][0]["sizes"][0]["height_px"], 1200);
  EXPECT_EQ(json["configured"][0]["seen"], true);
  EXPECT_EQ(json["configured"][1]["seen"], false);
}

TEST(CameraList, SaysWhatWasLookedAtWhereThereIsNone) {
  const Configuration configuration;
  const CameraList list(configuration, {{}, {"V4L2: /dev/video*"}});
  EXPECT_THAT(list.text(), HasSubstr("no camera found; searched:\n    V4L2: /dev/video*\n"));
}

TEST(CameraList, OffersCamerasOfTheSameDriver) {
  const Configuration configuration;
  ListedCamera other = gige_camera();
  other.driver = "v4l2";
  other.name = "/dev/video0";
  const CameraList list(configuration, {{gige_camera(), other}, {}});
  EXPECT_THAT(list.similar_to(configured("S78")), HasSubstr("Maker-S77"));
  EXPECT_THAT(list.similar_to(configured("S78")), Not(HasSubstr("/dev/video0")));
}

}  // namespace
}  // namespace slsd
