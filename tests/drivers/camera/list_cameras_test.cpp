// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/listing/list_cameras.hpp"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "drivers/camera/aravis/aravis_camera.hpp"
#include "drivers/camera/v4l2/list_v4l2_cameras.hpp"
#include "drivers/camera/v4l2/v4l2_device.hpp"
#include "tests/drivers/camera/aravis/gige_backend.hpp"
#include "tests/drivers/camera/v4l2/v4l2_backends.hpp"
#include "tests/drivers/temporary_folder.hpp"

namespace slsd {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

/// A host of which only the networks are real.
class ListCameras : public ::testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::permissions(folder_.path(), std::filesystem::perms(0755));
    std::filesystem::create_directories(places_.devices);
  }

  /// A camera on USB, in sysfs; its interface 0 has this class.
  [[nodiscard]] std::filesystem::path plug_in(const std::string& interface_class) const {
    const std::string device = "sys/devices/usb1/1-2/";
    for (const auto& [file, text] :
         {std::pair("idVendor", "2676"), std::pair("manufacturer", "Maker"), std::pair("product", "Camera 5"),
          std::pair("serial", "S77"), std::pair("speed", "5000"), std::pair("busnum", "999"), std::pair("devnum", "7")})
      folder_.write(device + file, std::string(text) + "\n");
    folder_.write(device + "1-2:1.0/bInterfaceClass", interface_class + "\n");
    folder_.write(device + "1-2:1.0/bInterfaceSubClass", "05\n");
    return folder_.path() / device;
  }

  [[nodiscard]] static std::optional<ListedCamera> find(const std::vector<ListedCamera>& cameras,
                                                        const std::string& key) {
    for (const ListedCamera& camera : cameras)
      if (camera.name == key || camera.address == key) return camera;
    return std::nullopt;
  }
  [[nodiscard]] std::optional<ListedCamera> find(const std::string& key) const {
    return find(list_cameras(places_).cameras, key);
  }
  /// Without the seconds that networks take.
  [[nodiscard]] std::optional<ListedCamera> find_v4l2(const std::string& key) const {
    return find(list_v4l2_cameras(places_.devices, places_.sysfs, places_.configured_nodes), key);
  }

  test::TemporaryFolder folder_;
  ListingPlaces places_{folder_.path() / "dev", folder_.path() / "sys", {}, {}};
};

TEST_F(ListCameras, NamesAV4l2CameraById) {
  test::DoubleOptions options = test::quick_double();
  options.formats = {{V4L2_PIX_FMT_GREY, {{160, 120}, {80, 60}}}, {V4L2_PIX_FMT_YUYV, {{320, 240}}}};
  const auto device = test::V4l2Double::create(options);
  if (!device) GTEST_SKIP() << to_string(device.error());
  const auto by_id = places_.devices / "v4l/by-id/usb-Maker_Camera_5_S77-video-index0";
  std::filesystem::create_directories(by_id.parent_path());
  std::filesystem::create_symlink((*device)->path(), places_.devices / "video3");
  std::filesystem::create_symlink("../../video3", by_id);
  const auto usb = plug_in("0e");
  std::filesystem::create_directories(places_.sysfs / "class/video4linux/video3");
  std::filesystem::create_symlink(usb / "1-2:1.0", places_.sysfs / "class/video4linux/video3/device");
  const auto camera = find_v4l2(by_id.string());
  ASSERT_TRUE(camera);
  EXPECT_EQ(camera->driver, "v4l2");
  EXPECT_EQ(camera->node, (places_.devices / "video3").string());
  EXPECT_EQ(camera->kernel_driver, "slsd-double");
  EXPECT_EQ(camera->vendor, "Maker");
  EXPECT_EQ(camera->serial, "S77");
  EXPECT_EQ(camera->link_mbps, 5000);
  EXPECT_EQ(camera->problem, "");
  EXPECT_THAT(camera->formats,
              ElementsAre(ListedFormat{"GREY", {{160, 120}, {80, 60}}}, ListedFormat{"YUYV", {{320, 240}}}));
}

TEST_F(ListCameras, LooksAtTheNodesThatTheConfigurationNames) {
  const auto device = test::V4l2Double::create(test::quick_double());
  if (!device) GTEST_SKIP() << to_string(device.error());
  places_.configured_nodes = {(*device)->path()};
  EXPECT_TRUE(find_v4l2((*device)->path().string()));
}

TEST_F(ListCameras, SaysWhatToDoWhereANodeMayNotBeOpened) {
  const auto node = folder_.write("dev/video0", "");
  folder_.write("sys/class/video4linux/video0/name", "Camera 5\n");
  std::filesystem::permissions(node, std::filesystem::perms::none);
  constexpr uid_t kNobody = 65534;
  const bool root = ::geteuid() == 0;
  ASSERT_TRUE(!root || ::seteuid(kNobody) == 0);
  const auto camera = find_v4l2(node.string());
  ASSERT_TRUE(!root || ::seteuid(0) == 0);
  ASSERT_TRUE(camera);
  EXPECT_EQ(camera->model, "Camera 5");
  EXPECT_THAT(camera->problem, HasSubstr("group video"));
}

TEST_F(ListCameras, PassesOverWhatIsNoCamera) {
  folder_.write("dev/video0", "");
  folder_.write("dev/videodisc", "");
  folder_.write("dev/video1x", "");
  EXPECT_THAT(list_v4l2_cameras(places_.devices, places_.sysfs, {}), IsEmpty());
}

TEST_F(ListCameras, DescribesAGigeCameraByItsAddress) {
  test::GigeCamera device;
  places_.configured_ids = {device.address()};
  const auto camera = find(device.address());
  ASSERT_TRUE(camera);
  EXPECT_EQ(camera->standard, "GigE Vision");
  EXPECT_EQ(camera->name, "Aravis-DOUBLE-1");
  EXPECT_EQ(camera->serial, "DOUBLE-1");
  EXPECT_THAT(camera->interface, StartsWith("lo (127."));
  EXPECT_EQ(camera->user, "");
  EXPECT_EQ(camera->problem, "");
  EXPECT_THAT(camera->formats, Contains(ListedFormat{"Mono8", {{64, 48}}}));
  EXPECT_EQ(device.read(test::kControlPrivilege), 0u);
}

TEST_F(ListCameras, SaysWhoControlsAGigeCameraAndLetsItBe) {
  test::GigeCamera device;
  places_.configured_ids = {device.address()};
  AravisCamera camera(test::options_for(device));
  ASSERT_TRUE(camera.open());
  const auto listed = find(device.address());
  ASSERT_TRUE(listed);
  EXPECT_THAT(listed->user, StartsWith("a program on this host (127."));
  EXPECT_THAT(listed->formats, IsEmpty());
  EXPECT_EQ(device.times_taken(), 1);
  device.occupy(true);
  EXPECT_EQ(find(device.address())->user, "another application");
}

TEST_F(ListCameras, SaysWhatToDoWhereAUsb3VisionCameraMayNotBeWritten) {
  const auto device = plug_in("ef");
  std::filesystem::create_directories(places_.sysfs / "bus/usb/devices");
  std::filesystem::create_symlink(device, places_.sysfs / "bus/usb/devices/1-2");
  const auto camera = find("Maker-S77");
  ASSERT_TRUE(camera);
  EXPECT_EQ(camera->standard, "USB3 Vision");
  EXPECT_EQ(camera->node, "/dev/bus/usb/999/007");
  EXPECT_EQ(camera->link_mbps, 5000);
  EXPECT_THAT(camera->problem, HasSubstr("ATTRS{idVendor}==\"2676\""));
}

TEST_F(ListCameras, SaysWhereItLooked) {
  places_.configured_ids = {"127.78.0.1"};
  EXPECT_THAT(list_cameras(places_).looked_at,
              ElementsAre("V4L2: " + (places_.devices / "video*").string(), StartsWith("GigE Vision: by broadcast on "),
                          "USB3 Vision: " + (places_.sysfs / "bus/usb/devices").string(),
                          "GigE Vision, USB3 Vision: 127.78.0.1"));
}

TEST(FindStableLink, FindsTheLinkByAnyNameOfTheNode) {
  const test::TemporaryFolder devices;
  const auto node = devices.write("video3", "");
  const auto other = devices.write("video4", "");
  std::filesystem::create_directories(devices.path() / "v4l/by-id");
  const auto link = devices.path() / "v4l/by-id/usb-Maker-video-index0";
  std::filesystem::create_symlink(node, link);
  EXPECT_EQ(find_stable_link(node, devices.path()), link);
  EXPECT_EQ(find_stable_link(link, devices.path()), link);
  EXPECT_EQ(find_stable_link(other, devices.path()), std::nullopt);
  EXPECT_EQ(find_stable_link(node, devices.path() / "nowhere"), std::nullopt);
}

TEST(DeviceText, IsPrintableAndEndsWithItsField) {
  const unsigned char text[8] = "card\033\n";
  EXPECT_EQ(device_text(text), "card\\x1b\\n");
  const unsigned char without_end[4] = {'c', 'a', 'r', 'd'};
  EXPECT_EQ(device_text(without_end), "card");
}

}  // namespace
}  // namespace slsd
