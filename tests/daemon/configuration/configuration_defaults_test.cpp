// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// What holds where the file says nothing, and that the shipped file says the same.
#include <algorithm>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "tests/daemon/configuration/read_text.hpp"

namespace slsd {
namespace {

using test::read;

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
  EXPECT_EQ(a.black_box, b.black_box);
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

TEST(ReadConfiguration, ShippedCamerasEqualTheDefaults) {
  const auto cameras = shipped_cameras();
  ASSERT_EQ(cameras.size(), 3U);
  FileCameraOptions file;
  file.path = "etc/frames";
  V4l2CameraOptions v4l2;
  v4l2.device = "/dev/v4l/by-id/usb-maker_camera_serial-video-index0";
  AravisCameraOptions aravis;
  aravis.id = "192.0.2.10";
  EXPECT_THAT(cameras, testing::UnorderedElementsAre(CameraOptions{file, {}}, CameraOptions{v4l2, {}},
                                                     CameraOptions{aravis, {}}));
}

/// The part of the shipped file that begins with a line, up to the next table.
std::string shipped_part(const std::string& heading) {
  const std::string text = "\n" + shipped();
  const std::size_t begin = text.find("\n" + heading + "\n");
  if (begin == std::string::npos) return {};
  return text.substr(begin, text.find("\n[", begin + 2 + heading.size()) - begin);
}

// Every key stands in its table of the shipped file, in force or in a comment.
TEST(ReadConfiguration, ShippedFileHasEveryKey) {
  const std::pair<const char*, const char*> tables[] = {
      {"[pattern]",
       "file symbol_size_px spacing_px symbols seed method minimum_distance half_turn_unique row_reach "
       "column_reach"},
      {"[projector]", "driver monitor width_px height_px brightness gamma black_level refresh_hz idle idle_after_ms"},
      {"# [[camera]]",
       "name driver path loop rate_hz bayer faults device width_px height_px format frame_rate_hz exposure_us "
       "gain_steps "
       "focus_steps power_line_hz automatic readout_us settle_frames id interface trigger trigger_line gain_db "
       "pixel_format chunks action_device_key action_group_key action_group_mask action_lead_us ptp packet_bytes "
       "packet_delay_us receive_buffer_bytes packet_resend packet_socket frame_timeout_ms missed_frames_max "
       "frames_held_max"},
      {"[calibration]", "file other_hardware"},
      {"[decode]",
       "depth_min_mm depth_max_mm wrong_cells_max precision binarize find_regions classify centre link_grid "
       "decode_windows correspond"},
      {"[scan]", "timeout_ms exposure_skew_ms reopen_first_ms reopen_longest_ms projector_latency_ms power_line_hz"},
      {"[server]",
       "socket socket_mode observe scan administer clients_max request_bytes_max memory_max_mb send_timeout_ms"}};
  for (const auto& [heading, keys] : tables) {
    const std::string part = shipped_part(heading);
    std::istringstream words(keys);
    for (std::string key; words >> key;) {
      EXPECT_TRUE(std::regex_search(part, std::regex("\n(# )*" + key + " = "))) << heading << " " << key;
    }
  }
}

}  // namespace
}  // namespace slsd
