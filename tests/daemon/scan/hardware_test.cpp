// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/hardware.hpp"

#include <gmock/gmock.h>

#include "tests/core/geometry/paper_rig.hpp"

namespace slsd {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

DeviceStatus device(const std::string& driver, const std::string& name) {
  DeviceStatus status;
  status.driver = driver;
  status.device = name;
  return status;
}

TEST(HardwareId, IsOfDevicesThatHaveASerialNumber) {
  EXPECT_EQ(hardware_id("aravis", "Maker-Model-17"), "Maker-Model-17");
  EXPECT_EQ(hardware_id("aravis", "Maker\nModel"), "Maker Model");
  EXPECT_EQ(hardware_id("v4l2", "/dev/v4l/by-id/usb-Maker_Model_17-video-index0"), "usb-Maker_Model_17-video-index0");
  EXPECT_EQ(hardware_id("v4l2", "/nowhere/video0"), "");
  EXPECT_EQ(hardware_id("file", "frames"), "");
  RandrOutput output;
  output.model = "Maker Model";
  EXPECT_EQ(hardware_id(output), "");
  output.serial = "17";
  EXPECT_EQ(hardware_id(output), "Maker Model 17");
}

TEST(NoteHardware, WritesDownWhatCanBeTold) {
  Calibration calibration = paper_rig();
  calibration.cameras.push_back(calibration.cameras.front());
  note_hardware({}, {}, calibration);
  EXPECT_TRUE(calibration.report.camera_serials.empty());
  const std::vector<DeviceStatus> cameras{device("file", "frames"), device("aravis", "Maker-Model-17")};
  note_hardware(cameras, {}, calibration);
  EXPECT_THAT(calibration.report.camera_serials, ElementsAre("", "Maker-Model-17"));
  EXPECT_FALSE(calibration.report.projector_serial);
  EXPECT_EQ(calibrated_hardware(calibration, calibration.cameras[1]), "Maker-Model-17");
  const Calibration unknown = paper_rig();
  EXPECT_EQ(calibrated_hardware(unknown, unknown.cameras[0]), "");
}

TEST(CheckHardware, RefusesAnotherDeviceWhereBothAreKnown) {
  EXPECT_TRUE(check_hardware("camera left", "A-1", "A-1"));
  EXPECT_TRUE(check_hardware("camera left", "", "A-2"));
  EXPECT_TRUE(check_hardware("camera left", "A-1", ""));
  const auto other = check_hardware("camera left", "A-1", "A-2");
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::kMismatch);
  EXPECT_EQ(other.error().where, "camera left");
  EXPECT_THAT(other.error().message, HasSubstr("other_hardware"));
}

}  // namespace
}  // namespace slsd
