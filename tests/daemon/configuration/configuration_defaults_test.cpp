// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// What holds where the file says nothing, and that the shipped file says the same.
#include <fstream>
#include <iterator>
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
  EXPECT_EQ(a.frame, b.frame);
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

}  // namespace
}  // namespace slsd
