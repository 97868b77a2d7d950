// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/latency/latency_file.hpp"

#include <gmock/gmock.h>

namespace slsd {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

LatencyReport report() {
  LatencyReport report{"2024-05-06T07:08:09Z", "glfw \"HDMI-1\"", {}};
  report.cameras.push_back({"left", 20, 34567us, 50000us, 36000us, 64000us, false});
  report.cameras.push_back({"right", 20, 0us, 1us, 2us, 3us, false});
  return report;
}

TEST(LatencyFile, IsReadAsItWasWritten) {
  const auto read = read_latency(write_latency(report()), "latency.toml");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->date, report().date);
  EXPECT_EQ(read->projector, report().projector);
  EXPECT_EQ(read->cameras, report().cameras);
  LatencyReport clipped = report();
  clipped.cameras[0].clipped = true;
  EXPECT_EQ(read_latency(write_latency(clipped), "latency.toml")->cameras, clipped.cameras);
}

TEST(LatencyFile, NamesWhatIsWrong) {
  const auto unknown = read_latency("date = \"x\"\nlatency = 3\n", "latency.toml");
  ASSERT_FALSE(unknown);
  EXPECT_THAT(to_string(unknown.error()), HasSubstr("latency.toml:2:1"));
  EXPECT_FALSE(read_latency("[[camera]\n", "latency.toml"));
  EXPECT_FALSE(read_latency("[[camera]]\nlatency_us = \"soon\"\n", "latency.toml"));
}

TEST(LatencyFile, RefusesNegativeTimes) {
  for (const std::string key : {"flashes", "latency_us", "median_us", "p05_us", "p95_us"}) {
    const auto read = read_latency("[[camera]]\nname = \"left\"\n" + key + " = -1\n", "latency.toml");
    ASSERT_FALSE(read) << key;
    EXPECT_EQ(read.error().code, ErrorCode::kInvalidArgument);
    EXPECT_THAT(to_string(read.error()),
                AllOf(HasSubstr("latency.toml:3:"), HasSubstr(key), HasSubstr("measure again")));
  }
}

CameraOptions camera(const std::string& name) {
  FileCameraOptions options;
  options.name = name;
  return {options, {}};
}

/// A configuration that the report goes with.
Configuration configuration_of_report() {
  Configuration configuration;
  configuration.cameras = {camera("left"), camera("right")};
  configuration.scan.projector_latency_ms = 35;
  return configuration;
}

TEST(LatencyWarnings, AreOfAnotherProjector) {
  const Configuration configuration = configuration_of_report();
  EXPECT_THAT(latency_warnings(configuration, report(), report().projector), IsEmpty());
  EXPECT_THAT(latency_warnings(configuration, report(), projector_name("glfw", "DP-1")),
              ElementsAre(AllOf(HasSubstr("HDMI-1"), HasSubstr("\"glfw DP-1\""))));
}

TEST(LatencyWarnings, AreOfOverexposedCameras) {
  LatencyReport clipped = report();
  clipped.cameras[1].clipped = true;
  EXPECT_THAT(latency_warnings(configuration_of_report(), clipped, ""),
              ElementsAre(AllOf(HasSubstr("\"right\""), HasSubstr("overexposed"))));
}

TEST(LatencyWarnings, AreOfShortSettingsAndOfCamerasThatWereNotMeasured) {
  Configuration configuration;
  configuration.cameras = {camera("left"), camera("third")};
  configuration.scan.projector_latency_ms = 30;
  EXPECT_THAT(latency_warnings(configuration, report(), ""),
              ElementsAre(AllOf(HasSubstr("\"left\""), HasSubstr("34.6 ms"), HasSubstr("set 35")),
                          AllOf(HasSubstr("\"third\""), HasSubstr("not measured"))));
  configuration.scan.projector_latency_ms = 35;
  configuration.cameras[1] = camera("right");
  EXPECT_THAT(latency_warnings(configuration, report(), ""), IsEmpty());
}

TEST(LatencyFile, LiesBesideTheCalibration) {
  Configuration configuration;
  EXPECT_EQ(latency_file(configuration, "etc/slsd.toml"), "etc/latency.toml");
  configuration.calibration_file = "var/calibration.yml";
  EXPECT_EQ(latency_file(configuration, "etc/slsd.toml"), "var/latency.toml");
}

}  // namespace
}  // namespace slsd
