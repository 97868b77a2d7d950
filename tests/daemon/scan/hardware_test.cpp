// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/hardware.hpp"

#include <gmock/gmock.h>

#include "tests/core/geometry/paper_rig.hpp"

namespace slsd {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

DeviceStatus device(const std::string& name, const std::string& hardware) {
  DeviceStatus status;
  status.name = name;
  status.hardware = hardware;
  return status;
}

/// A calibration of two cameras, and of the devices.
Calibration calibrated_with(const RigStatus& rig) {
  Calibration calibration = paper_rig();
  calibration.cameras.front().name = "left";
  calibration.cameras.push_back(calibration.cameras.front());
  calibration.cameras.back().name = "right";
  note_hardware(rig, calibration);
  return calibration;
}

TEST(ProjectorHardware, IsOfDevicesThatHaveASerialNumber) {
  EXPECT_EQ(projector_hardware("Maker Model", ""), "");
  EXPECT_EQ(projector_hardware("Maker Model", "17"), "Maker Model 17");
  EXPECT_EQ(projector_hardware("", "17"), "17");
}

TEST(NoteHardware, WritesDownWhatCanBeTold) {
  const Calibration unknown = calibrated_with({device("projector", ""), {device("left", ""), device("right", "")}});
  EXPECT_TRUE(unknown.report.camera_serials.empty());
  EXPECT_FALSE(unknown.report.projector_serial);
  EXPECT_EQ(calibrated_hardware(unknown, unknown.cameras[0]), "");
  const Calibration known = calibrated_with({device("projector", "P-1"), {device("left", ""), device("right", "C-1")}});
  EXPECT_THAT(known.report.camera_serials, ElementsAre("", "C-1"));
  EXPECT_EQ(known.report.projector_serial, "P-1");
  EXPECT_EQ(calibrated_hardware(known, known.cameras[1]), "C-1");
}

TEST(CheckHardware, NamesTheDeviceOfARigThatIsAnother) {
  const RigStatus rig{device("projector", "P-1"), {device("left", "C-1"), device("right", "C-2")}};
  const Calibration calibration = calibrated_with(rig);
  EXPECT_TRUE(check_hardware(calibration, rig));
  EXPECT_TRUE(check_hardware(paper_rig(), rig));
  RigStatus other = rig;
  other.cameras[1].hardware = "C-3";
  EXPECT_EQ(check_hardware(calibration, other).error().where, "camera right");
  other = rig;
  other.projector.hardware = "P-2";
  EXPECT_EQ(check_hardware(calibration, other).error().where, "projector");
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
