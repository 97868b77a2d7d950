// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// The keys of a [[camera]] table, driver by driver.
#include <optional>
#include <utility>

#include <gmock/gmock.h>

#include "tests/daemon/configuration/read_text.hpp"

namespace slsd {
namespace {

using test::error_of;
using test::read;
using ::testing::HasSubstr;

TEST(ReadConfiguration, TakesEveryKeyOfV4l2) {
  const auto configuration = read(R"(
[[camera]]
name = "left"
driver = "v4l2"
device = "usb-camera"
format = "Y16"
width_px = 640
height_px = 480
frame_rate_hz = 30
exposure_us = 16700
gain_steps = 12
focus_steps = 40
power_line_hz = 50
automatic = false
readout_us = 8000.5
settle_frames = 5
frames_held_max = 4
missed_frames_max = 7
faults = ["drop@3"]
)");
  ASSERT_TRUE(configuration) << to_string(configuration.error());
  const CameraOptions& camera = configuration->cameras.at(0);
  const V4l2CameraOptions expected{
      "left", "usb-camera", "Y16", std::pair(640, 480), 30.0, 16700.0, std::nullopt, 12, 40, 50, false, 8000.5, 5, 4,
      7};
  EXPECT_EQ(camera.driver(), "v4l2");
  EXPECT_EQ(std::get<V4l2CameraOptions>(camera.of_driver), expected);
  EXPECT_EQ(camera.faults.size(), 1U);
}

TEST(ReadConfiguration, TakesTwoExposuresOfEveryDriver) {
  const std::string both = "exposures_us = [2000, 8000]\n";
  for (const auto* driver :
       {"driver = \"v4l2\"\ndevice = \"x\"\n", "driver = \"aravis\"\nid = \"1\"\n", "path = \"x\"\n"}) {
    const auto configuration = read("[[camera]]\n" + std::string(driver) + both);
    ASSERT_TRUE(configuration) << to_string(configuration.error());
    const CameraOptions& camera = configuration->cameras.at(0);
    EXPECT_THAT(camera.exposures_us, ::testing::ElementsAre(2000, 8000));
    EXPECT_EQ(camera.exposure_us(), camera.replays() ? std::nullopt : std::optional(2000.0)) << driver;
  }
}

TEST(ReadConfiguration, TakesAWhiteBalanceOfThreeFactors) {
  const auto with = [](const std::string& factors) {
    return read("[[camera]]\npath = \"x\"\n" + (factors.empty() ? "" : "white_balance = " + factors + "\n"));
  };
  EXPECT_EQ(with("")->cameras.at(0).white_balance, (ColourGains{1, 1, 1}));
  EXPECT_EQ(with("[1.6, 1, 1.9]")->cameras.at(0).white_balance, (ColourGains{1.6, 1, 1.9}));
  for (const auto* wrong : {"[1.6, 1]", "[0, 1, 1]", "[1, 1, 11.0]", "[1, nan, 1]", "1.5", "[]"})
    EXPECT_FALSE(with(wrong).has_value()) << wrong;
}

TEST(ReadConfiguration, PutsTextureCamerasLast) {
  const auto with = [](const std::string& first, const std::string& second) {
    return read("[[camera]]\nname = \"a\"\npath = \"x\"\n" + first + "[[camera]]\nname = \"b\"\npath = \"x\"\n" +
                second + "[[camera]]\nname = \"c\"\npath = \"x\"\n");
  };
  const auto names = [](const Result<Configuration>& configuration) {
    std::string all;
    for (const CameraOptions& camera : configuration->cameras)
      all += camera.name() + (camera.measures() ? " " : " texture ");
    return all;
  };
  EXPECT_EQ(names(with("", "")), "a b c ");
  EXPECT_EQ(names(with("use = \"texture\"\n", "use = \"points\"\n")), "b c a texture ");
  EXPECT_EQ(names(with("use = \"texture\"\n", "use = \"texture\"\n")), "c a texture b texture ");
  EXPECT_THAT(error_of("[[camera]]\npath = \"x\"\nuse = \"colour\"\n"), HasSubstr("points, texture"));
  EXPECT_THAT(error_of("[[camera]]\npath = \"x\"\nuse = \"texture\"\n"), HasSubstr("add a camera that measures"));
  EXPECT_THAT(error_of("[[camera]]\npath = \"x\"\n[[camera]]\nname = \"t\"\npath = \"x\"\nuse = \"texture\"\n"
                       "exposures_us = [2000, 8000]\n"),
              HasSubstr("set exposure_us"));
}

TEST(ReadConfiguration, TakesAGainOfV4l2InDecibels) {
  const auto configuration = read("[[camera]]\ndriver = \"v4l2\"\ndevice = \"x\"\ngain_db = 6\n");
  ASSERT_TRUE(configuration) << to_string(configuration.error());
  EXPECT_EQ(configuration->cameras.at(0).gain_db(), 6.0);
}

TEST(ReadConfiguration, TakesEveryKeyOfAravis) {
  const auto configuration = read(R"(
[[camera]]
name = "left"
driver = "aravis"
id = "Vendor-1234"
interface = "192.0.2.1"
trigger = "line"
trigger_line = "Line3"
action_device_key = 4294967295
action_group_key = 7
action_group_mask = 2
action_lead_us = 2000
ptp = true
rate_hz = 30
exposure_us = 16667
gain_db = 3.5
pixel_format = "BayerRG12"
width_px = 640
height_px = 480
chunks = false
packet_bytes = 1500
packet_delay_us = 2.5
receive_buffer_bytes = 100000
packet_resend = false
packet_socket = false
frame_timeout_ms = 50
missed_frames_max = 3
frames_held_max = 4
faults = ["drop@3"]
)");
  ASSERT_TRUE(configuration) << to_string(configuration.error());
  const CameraOptions& camera = configuration->cameras.at(0);
  const AravisCameraOptions expected{.name = "left",
                                     .id = "Vendor-1234",
                                     .interface = "192.0.2.1",
                                     .trigger = AravisTrigger::kLine,
                                     .trigger_line = "Line3",
                                     .action = {4294967295, 7, 2},
                                     .action_lead_us = 2000.0,
                                     .ptp = true,
                                     .rate_hz = 30.0,
                                     .exposure_us = 16667.0,
                                     .gain_db = 3.5,
                                     .pixel_format = "BayerRG12",
                                     .size_px = std::pair(640, 480),
                                     .chunks = false,
                                     .packet_bytes = 1500,
                                     .packet_delay_us = 2.5,
                                     .receive_buffer_bytes = 100000,
                                     .packet_resend = false,
                                     .packet_socket = false,
                                     .frame_timeout_ms = 50,
                                     .missed_frames_max = 3,
                                     .frames_held_max = 4};
  EXPECT_EQ(camera.driver(), "aravis");
  EXPECT_EQ(std::get<AravisCameraOptions>(camera.of_driver), expected);
  EXPECT_EQ(camera.faults.size(), 1U);
}

TEST(ReadConfiguration, NamesTheDriverWhoseKeyItIs) {
  EXPECT_THAT(error_of("[[camera]]\ndriver = \"v4l2\"\ndevice = \"x\"\nloop = true\n"),
              HasSubstr("slsd.toml:4:8: [[camera]] loop is a key of the driver \"file\", not of \"v4l2\""));
  EXPECT_THAT(error_of("[[camera]]\npath = \"x\"\ngain_steps = 1\n"),
              HasSubstr("gain_steps is a key of the driver \"v4l2\", not of \"file\""));
}

}  // namespace
}  // namespace slsd
