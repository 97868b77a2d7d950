// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/configuration/configuration.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <sstream>
#include <vector>

#include <gmock/gmock.h>

namespace slsd {
namespace {

using ::testing::HasSubstr;

Result<Configuration> read(const std::string& text) {
  return read_configuration(text, "etc/slsd.toml");
}

std::string error_of(const std::string& text) {
  const auto configuration = read(text);
  return configuration ? "" : to_string(configuration.error());
}

std::string shipped() {
  std::ifstream file(std::string(SLSD_SOURCE_DIR) + "/config/slsd.toml");
  return {std::istreambuf_iterator<char>(file), {}};
}

void expect_equal(const Configuration& a, const Configuration& b) {
  EXPECT_EQ(a.pattern_file, b.pattern_file);
  EXPECT_EQ(a.pattern, b.pattern);
  EXPECT_EQ(a.projector, b.projector);
  EXPECT_EQ(a.cameras, b.cameras);
  EXPECT_EQ(a.calibration_file, b.calibration_file);
  EXPECT_EQ(a.other_hardware, b.other_hardware);
  EXPECT_EQ(a.decode, b.decode);
  EXPECT_EQ(a.scan, b.scan);
  EXPECT_EQ(a.server, b.server);
}

TEST(ReadConfiguration, OfNothingGivesTheDefaults) {
  const auto configuration = read("");
  ASSERT_TRUE(configuration) << to_string(configuration.error());
  Configuration defaults;
  defaults.pattern.symbols = default_symbols(16);
  expect_equal(*configuration, defaults);
  EXPECT_EQ(configuration->pattern.symbol_size_px, 16);
  EXPECT_EQ(configuration->pattern.spacing_px, 2);
  EXPECT_EQ(configuration->projector.width_px, 1280);
  EXPECT_EQ(configuration->projector.height_px, 800);
}

TEST(ReadConfiguration, ShippedFileEqualsTheDefaults) {
  const auto configuration = read(shipped());
  ASSERT_TRUE(configuration) << to_string(configuration.error());
  expect_equal(*configuration, *read(""));
}

// The shipped file shows a camera of each driver in comments; taken out of them, each has every default but where it
// is.
std::vector<CameraOptions> shipped_cameras() {
  std::istringstream lines(shipped());
  std::vector<std::string> texts;
  bool within = false;
  for (std::string line; std::getline(lines, line);) {
    if (line == "# [[camera]]") texts.emplace_back(), within = true;
    within = within && !line.empty();
    if (within) texts.back() += line.substr(2) + "\n";
  }
  std::vector<CameraOptions> cameras;
  for (const std::string& text : texts) {
    const auto configuration = read(text);
    EXPECT_TRUE(configuration) << to_string(configuration.error());
    if (configuration) cameras.insert(cameras.end(), configuration->cameras.begin(), configuration->cameras.end());
  }
  return cameras;
}

const CameraOptions& shipped_camera(const std::vector<CameraOptions>& cameras, CameraDriver driver) {
  return *std::ranges::find(cameras, driver, &CameraOptions::driver);
}

TEST(ReadConfiguration, ShippedCamerasEqualTheDefaults) {
  const auto cameras = shipped_cameras();
  ASSERT_EQ(cameras.size(), 3U);
  CameraOptions file;
  file.file.path = "etc/frames";
  EXPECT_EQ(shipped_camera(cameras, CameraDriver::kFile), file);
  CameraOptions v4l2;
  v4l2.driver = CameraDriver::kV4l2;
  v4l2.v4l2.device = "/dev/v4l/by-id/usb-maker_camera_serial-video-index0";
  EXPECT_EQ(shipped_camera(cameras, CameraDriver::kV4l2), v4l2);
  CameraOptions aravis;
  aravis.driver = CameraDriver::kAravis;
  aravis.aravis.id = "192.0.2.10";
  EXPECT_EQ(shipped_camera(cameras, CameraDriver::kAravis), aravis);
}

TEST(ReadConfiguration, KeepsTheKeysAsTheyWereGiven) {
  const auto configuration = read("[decode]\ndepth_min_mm = 500.5\n[[camera]]\npath = \"x\"\nloop = false\n");
  ASSERT_TRUE(configuration) << to_string(configuration.error());
  EXPECT_EQ(configuration->given, nlohmann::json::parse(R"({"decode": {"depth_min_mm": 500.5},
                                                            "camera": [{"path": "x", "loop": false}]})"));
}

// Every key of the tables stands in the shipped file, in force or in a comment.
TEST(ReadConfiguration, ShippedFileHasEveryKey) {
  for (const char* key : {"file",
                          "symbol_size_px",
                          "spacing_px",
                          "symbols",
                          "seed",
                          "method",
                          "minimum_distance",
                          "half_turn_unique",
                          "driver",
                          "monitor",
                          "width_px",
                          "height_px",
                          "brightness",
                          "gamma",
                          "black_level",
                          "refresh_hz",
                          "idle",
                          "idle_after_ms",
                          "name",
                          "path",
                          "loop",
                          "rate_hz",
                          "bayer",
                          "faults",
                          "device",
                          "format",
                          "frame_rate_hz",
                          "exposure_us",
                          "gain_steps",
                          "focus_steps",
                          "power_line_hz",
                          "automatic",
                          "readout_us",
                          "settle_frames",
                          "id",
                          "interface",
                          "trigger",
                          "trigger_line",
                          "gain_db",
                          "pixel_format",
                          "chunks",
                          "packet_bytes",
                          "packet_delay_us",
                          "receive_buffer_bytes",
                          "packet_resend",
                          "packet_socket",
                          "frame_timeout_ms",
                          "missed_frames_max",
                          "frames_held_max",
                          "depth_min_mm",
                          "depth_max_mm",
                          "binarize",
                          "classify",
                          "centre",
                          "link_grid",
                          "decode_windows",
                          "correspond",
                          "timeout_ms",
                          "exposure_skew_ms",
                          "reopen_first_ms",
                          "reopen_longest_ms",
                          "projector_latency_ms",
                          "socket",
                          "socket_mode",
                          "clients_max",
                          "request_bytes_max",
                          "send_timeout_ms"}) {
    EXPECT_THAT(shipped(), HasSubstr(std::string(key) + " = "));
  }
}

TEST(ReadConfiguration, TakesEveryKey) {
  const auto configuration = read(R"(
[pattern]
symbol_size_px = 8
spacing_px = 1
symbols = [7, 22, 25, 5]
seed = 4294967295
method = "constructive"
minimum_distance = 2
half_turn_unique = true
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
classify = "paper"
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
  EXPECT_EQ(configuration->pattern.projector_width_px, 1920);
  EXPECT_EQ(configuration->projector.driver, ProjectorDriver::kGlfw);
  EXPECT_EQ(configuration->projector.light.brightness, 0.5);
  EXPECT_EQ(configuration->projector.light.gamma, (std::vector<double>{0, 0.25, 1}));
  EXPECT_EQ(configuration->projector.light.black_level, 16);
  EXPECT_EQ(configuration->projector.refresh_hz, 120.0);
  EXPECT_EQ(configuration->projector.idle, IdlePicture::kBlack);
  EXPECT_EQ(configuration->projector.idle_after_ms, 0);
  EXPECT_EQ(configuration->scan.projector_latency_ms, 34.5);
  EXPECT_EQ(configuration->scan.power_line_hz, 60);
  EXPECT_EQ(configuration->cameras.at(0).file.path, "/frames");
  EXPECT_EQ(configuration->cameras.at(0).file.size_px, std::pair(640, 480));
  EXPECT_EQ(configuration->cameras.at(0).faults.at(0).capture, 3U);
  EXPECT_EQ(configuration->calibration_file, "etc/calibration.yml");
  EXPECT_EQ(configuration->other_hardware, OtherHardware::kWarn);
  EXPECT_EQ(configuration->decode.classify, Method::kPaper);
  EXPECT_EQ(configuration->decode.depth_min_mm, 100.0);
  EXPECT_EQ(configuration->server.socket, "etc/run/s");
  EXPECT_EQ(configuration->server.socket_mode, 0600);
}

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
faults = ["drop@3"]
)");
  ASSERT_TRUE(configuration) << to_string(configuration.error());
  const CameraOptions& camera = configuration->cameras.at(0);
  const V4l2CameraOptions expected{
      "left", "usb-camera", "Y16", std::pair(640, 480), 30.0, 16700.0, std::nullopt, 12, 40, 50, false, 8000.5, 5, 4};
  EXPECT_EQ(camera.driver, CameraDriver::kV4l2);
  EXPECT_EQ(camera.v4l2, expected);
  EXPECT_EQ(camera.faults.size(), 1U);
}

TEST(ReadConfiguration, TakesAGainOfV4l2InDecibels) {
  const auto configuration = read("[[camera]]\ndriver = \"v4l2\"\ndevice = \"x\"\ngain_db = 6\n");
  ASSERT_TRUE(configuration) << to_string(configuration.error());
  EXPECT_EQ(configuration->cameras.at(0).v4l2.gain_db, 6.0);
}

TEST(ReadConfiguration, NamesTheDriverWhoseKeyItIs) {
  EXPECT_THAT(error_of("[[camera]]\ndriver = \"v4l2\"\ndevice = \"x\"\nloop = true\n"),
              HasSubstr("slsd.toml:4:8: [[camera]] loop is a key of the driver \"file\", not of \"v4l2\""));
  EXPECT_THAT(error_of("[[camera]]\npath = \"x\"\ngain_steps = 1\n"),
              HasSubstr("gain_steps is a key of the driver \"v4l2\", not of \"file\""));
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
  EXPECT_EQ(camera.driver, CameraDriver::kAravis);
  EXPECT_EQ(camera.aravis, expected);
  EXPECT_EQ(camera.faults.size(), 1U);
}

TEST(ReadConfiguration, TakesThePapersMethod) {
  const auto configuration = read("[pattern]\nsymbols = [5, 7, 22]\nmethod = \"paper\"\n");
  ASSERT_TRUE(configuration) << to_string(configuration.error());
  EXPECT_EQ(configuration->pattern.method, ArrayMethod::kPaper);
}

TEST(ReadConfiguration, NamesThePlaceAndTheRemedy) {
  EXPECT_EQ(error_of("[pattern]\nsymbol_size = 8\n"),
            "etc/slsd.toml:2:1: no such key in [pattern]: symbol_size; did you mean symbol_size_px?");
  EXPECT_EQ(error_of("[patern]\n"), "etc/slsd.toml:1:2: no such table or key: patern; did you mean pattern?");
  EXPECT_EQ(error_of("[pattern]\nseed = \"x\"\n"),
            "etc/slsd.toml:2:8: [pattern] seed must be a whole number from 0 to 4294967295");
  EXPECT_EQ(error_of("[server]\n\nclients_max = 0\n"),
            "etc/slsd.toml:3:15: [server] clients_max must be 1 to 10000, not 0");
  EXPECT_EQ(error_of("[projector]\ndriver = \"beamer\"\n"),
            "etc/slsd.toml:2:10: [projector] driver must be one of headless, glfw");
  EXPECT_EQ(error_of("[[camera]]\npath = \"a\"\n[[camera]]\npath = \"b\"\nname = \"camera\"\n"),
            "etc/slsd.toml:5:8: [[camera]] name \"camera\" is taken: give each camera a name of its own");
}

TEST(ReadConfiguration, PlacesRangesAtTheKey) {
  EXPECT_THAT(error_of("[pattern]\nspacing_px = 2\nsymbol_size_px = 9\n"), HasSubstr("slsd.toml:3:18: "));
  EXPECT_THAT(error_of("[pattern]\nsymbols = [7, 7]\n"), HasSubstr("slsd.toml:2:11: "));
  EXPECT_THAT(error_of("[projector]\nwidth_px = 100\n"), HasSubstr("slsd.toml:2:12: "));
  EXPECT_THAT(error_of("[projector]\nrefresh_hz = 5.0\n"), HasSubstr("slsd.toml:2:14: "));
  EXPECT_THAT(error_of("[scan]\nprojector_latency_ms = 1001\n"), HasSubstr("slsd.toml:2:24: "));
  EXPECT_THAT(error_of("[scan]\npower_line_hz = 55\n"), HasSubstr("slsd.toml:2:17: "));
  EXPECT_THAT(error_of("[decode]\ndepth_min_mm = 900.0\ndepth_max_mm = 800.0\n"), HasSubstr("slsd.toml:"));
  EXPECT_THAT(error_of("[[camera]]\npath = \"x\"\nrate_hz = -1\n"), HasSubstr("slsd.toml:3:11: "));
  EXPECT_THAT(error_of("[[camera]]\npath = \"x\"\nfaults = [\"explode@1\"]\n"), HasSubstr("slsd.toml:3:10: "));
  EXPECT_THAT(error_of("[[camera]]\n"), HasSubstr("path must name"));
  const std::string aravis = "[[camera]]\ndriver = \"aravis\"\nid = \"1\"\n";
  EXPECT_THAT(error_of(aravis + "pixel_format = \"Mono14p\"\n"), HasSubstr("slsd.toml:4:16: "));
  EXPECT_THAT(error_of(aravis + "exposure_us = 0.5\n"), HasSubstr("slsd.toml:4:15: "));
  EXPECT_THAT(error_of(aravis + "trigger = \"hand\"\n"), HasSubstr("software, line, free_run, action"));
  EXPECT_THAT(error_of(aravis + "path = \"x\"\n"), HasSubstr("path is a key of the driver \"file\""));
  const std::string v4l2 = "[[camera]]\ndriver = \"v4l2\"\ndevice = \"x\"\n";
  EXPECT_THAT(error_of(v4l2 + "exposure_us = 0.5\n"), HasSubstr("slsd.toml:4:15: "));
  EXPECT_THAT(error_of(v4l2 + "power_line_hz = 55\n"), HasSubstr("slsd.toml:4:17: "));
  EXPECT_THAT(error_of(v4l2 + "width_px = 640\n"), HasSubstr("needs height_px"));
}

TEST(ReadConfiguration, RefusesWrongTypes) {
  for (const char* text :
       {"pattern = 3", "camera = 3", "[camera]", "camera = [3]", "[pattern]\nsymbols = 5",
        "[pattern]\nsymbols = [\"5\"]", "[pattern]\nsymbols = [99999999999]", "[pattern]\nhalf_turn_unique = 1",
        "[pattern]\nseed = 1.0", "[pattern]\nseed = -1", "[decode]\ndepth_min_mm = nan", "[decode]\ndepth_min_mm = inf",
        "[decode]\ndepth_min_mm = \"1\"", "[server]\nsocket = 1", "[server]\nsocket = \"\\u0000\"",
        "[calibration]\nfile = []", "[[camera]]\npath = \"x\"\nfaults = [1]",
        "[[camera]]\npath = \"x\"\nwidth_px = 5"}) {
    EXPECT_THAT(error_of(text), HasSubstr("slsd.toml:")) << text;
  }
}

TEST(ReadConfiguration, FileExcludesTheOtherKeysOfAPattern) {
  EXPECT_TRUE(read("[pattern]\nfile = \"p.toml\"\n"));
  EXPECT_THAT(error_of("[pattern]\nfile = \"p.toml\"\nseed = 2\n"), HasSubstr("slsd.toml:3:8: [pattern] seed cannot"));
}

TEST(ReadConfiguration, RefusesWhatIsNoToml) {
  for (const std::string text : {"[pattern", "a = ", "\xff\xfe", "[a]\n[a]\n", "a = \"\n"}) {
    const auto configuration = read(text);
    ASSERT_FALSE(configuration);
    EXPECT_EQ(configuration.error().code, ErrorCode::kMalformed);
    EXPECT_THAT(configuration.error().where, HasSubstr("etc/slsd.toml:"));
  }
  EXPECT_FALSE(read("a = " + std::string(100000, '[')));
}

TEST(LoadConfiguration, NamesAFileThatIsMissing) {
  const auto configuration = load_configuration("/nowhere/slsd.toml");
  ASSERT_FALSE(configuration);
  EXPECT_EQ(configuration.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(to_string(configuration.error()), HasSubstr("/nowhere/slsd.toml"));
}

}  // namespace
}  // namespace slsd
