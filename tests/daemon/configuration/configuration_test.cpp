// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/configuration/configuration.hpp"

#include <utility>
#include <vector>

#include <gmock/gmock.h>

#include "tests/daemon/configuration/read_text.hpp"

namespace slsd {
namespace {

using test::error_of;
using test::read;
using ::testing::HasSubstr;

TEST(ReadConfiguration, TakesEveryKey) {
  const auto configuration = read(R"(
[pattern]
symbol_size_px = 8
spacing_px = 1
symbols = [7, 22, 25, 5]
seed = 4294967295
method = "no_repeats"
minimum_distance = 2
half_turn_unique = true
row_reach = 40
column_reach = 0
[projector]
driver = "glfw"
monitor = "HDMI-1"
width_px = 1920
height_px = 1080
brightness = 0.5
gamma = [0, 0.25, 1]
black_level = 16
refresh_hz = 120
idle = "black"
enable_output = true
idle_after_ms = 0
[[camera]]
name = "left"
path = "/frames"
loop = false
rate_hz = 30
width_px = 640
height_px = 480
bayer = "RGGB"
faults = ["drop@3"]
[calibration]
file = "calibration.yml"
other_hardware = "warn"
[decode]
depth_min_mm = 100
depth_max_mm = 200.5
wrong_cells_max = 0.0001
precision = "fine"
find_regions = "paper"
classify = "paper"
[frame]
output = "robot_base"
hand_eye = "hand_eye.yml"
[scan]
timeout_ms = 1
projector_latency_ms = 34.5
power_line_hz = 60
[server]
socket = "run/s"
socket_mode = 0o600
)");
  ASSERT_TRUE(configuration) << to_string(configuration.error());
  EXPECT_EQ(configuration->pattern.seed, 4294967295U);
  EXPECT_TRUE(configuration->pattern.half_turn_unique);
  EXPECT_EQ(configuration->pattern.minimum_distance, 2);
  EXPECT_EQ(configuration->pattern.method, ArrayMethod::kNoRepeats);
  EXPECT_EQ(configuration->pattern.row_reach, 40);
  EXPECT_EQ(configuration->pattern.column_reach, 0);
  EXPECT_EQ(configuration->pattern.projector_width_px, 1920);
  EXPECT_EQ(configuration->projector.driver, ProjectorDriver::kGlfw);
  EXPECT_EQ(configuration->projector.light.brightness, 0.5);
  EXPECT_EQ(configuration->projector.light.gamma, (std::vector<double>{0, 0.25, 1}));
  EXPECT_EQ(configuration->projector.light.black_level, 16);
  EXPECT_EQ(configuration->projector.refresh_hz, 120.0);
  EXPECT_EQ(configuration->projector.idle, Picture::kBlack);
  EXPECT_EQ(configuration->projector.enable_output, true);
  EXPECT_EQ(configuration->projector.idle_after_ms, 0);
  EXPECT_EQ(configuration->scan.projector_latency_ms, 34.5);
  EXPECT_EQ(configuration->scan.power_line_hz, 60);
  const auto& file = std::get<FileCameraOptions>(configuration->cameras.at(0).of_driver);
  EXPECT_EQ(file.path, "/frames");
  EXPECT_EQ(file.size_px, std::pair(640, 480));
  EXPECT_EQ(configuration->cameras.at(0).faults.at(0).capture, 3U);
  EXPECT_EQ(configuration->calibration_file, "etc/calibration.yml");
  EXPECT_EQ(configuration->other_hardware, OtherHardware::kWarn);
  EXPECT_EQ(configuration->frame.output, CoordinateFrame::kRobotBase);
  EXPECT_EQ(configuration->frame.hand_eye, "etc/hand_eye.yml");
  EXPECT_EQ(configuration->decode.binarize, Method::kDefault);
  EXPECT_EQ(configuration->decode.precision, Precision::kFine);
  EXPECT_EQ(configuration->decode.find_regions, Method::kPaper);
  EXPECT_EQ(configuration->decode.classify, Method::kPaper);
  EXPECT_EQ(configuration->decode.depth_min_mm, 100.0);
  EXPECT_EQ(configuration->decode.wrong_cells_max, 0.0001);
  EXPECT_EQ(configuration->server.socket, "etc/run/s");
  EXPECT_EQ(configuration->server.socket_mode, 0600);
}

TEST(ScanOptions, GiveCamerasAsLongForSettingsAsAScanMayWaitAndEnoughToReopen) {
  using std::chrono::milliseconds;
  EXPECT_EQ(ScanOptions{.timeout_ms = 1}.camera_settings_time(), milliseconds(20'000));
  EXPECT_EQ(ScanOptions{.timeout_ms = 20'001}.camera_settings_time(), milliseconds(20'001));
  EXPECT_EQ(ScanOptions{.timeout_ms = 600'000}.camera_settings_time(), milliseconds(600'000));
}

TEST(ReadConfiguration, KeepsTheKeysAsTheyWereGiven) {
  const auto configuration = read("[decode]\ndepth_min_mm = 500.5\n[[camera]]\npath = \"x\"\nloop = false\n");
  ASSERT_TRUE(configuration) << to_string(configuration.error());
  EXPECT_EQ(configuration->given, nlohmann::json::parse(R"({"decode": {"depth_min_mm": 500.5},
                                                            "camera": [{"path": "x", "loop": false}]})"));
}

TEST(ReadConfiguration, TakesThePapersMethod) {
  const auto configuration = read("[pattern]\nsymbols = [5, 7, 22]\nmethod = \"paper\"\n");
  ASSERT_TRUE(configuration) << to_string(configuration.error());
  EXPECT_EQ(configuration->pattern.method, ArrayMethod::kPaper);
}

TEST(ReadConfiguration, FileExcludesTheOtherKeysOfAPattern) {
  EXPECT_TRUE(read("[pattern]\nfile = \"p.toml\"\n"));
  EXPECT_THAT(error_of("[pattern]\nfile = \"p.toml\"\nseed = 2\n"), HasSubstr("slsd.toml:3:8: [pattern] seed cannot"));
}

}  // namespace
}  // namespace slsd
