// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/rig/hardware.hpp"

#include <chrono>
#include <utility>

#include <gmock/gmock.h>

#include "daemon/scan/rig/hardware_guard.hpp"
#include "drivers/projector/headless_projector.hpp"
#include "tests/core/geometry/paper_rig.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr int kWidthPx = 96;
constexpr int kHeightPx = 64;

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

/// A projector that can be pulled out and replaced by another one.
class ReplacedProjector final : public Projector {
 public:
  explicit ReplacedProjector(std::string serial)
      : memory_({.width_px = kWidthPx, .height_px = kHeightPx, .refresh_hz = 1000.0}),
        description_(memory_.description()) {
    description_.model = "Maker Model";
    description_.serial = std::move(serial);
  }
  [[nodiscard]] const ProjectorDescription& description() const override { return description_; }
  [[nodiscard]] Result<> open(MonotonicTime deadline) override { return memory_.open(deadline); }
  [[nodiscard]] Result<MonotonicTime> show(const Grey8& image, MonotonicTime deadline) override {
    return memory_.show(image, deadline);
  }
  [[nodiscard]] Result<> check(MonotonicTime deadline) override { return memory_.check(deadline); }
  [[nodiscard]] std::vector<std::string> warnings() const override { return {}; }
  [[nodiscard]] Result<Grey8> read_back() override { return memory_.read_back(); }

  void replace(std::string serial) {
    description_.serial = std::move(serial);
    memory_.disconnect();
  }

 private:
  HeadlessProjector memory_;
  ProjectorDescription description_;
};

std::shared_ptr<ScanSetup> calibrated(OtherHardware other_hardware) {
  auto setup = std::make_shared<ScanSetup>();
  setup->calibration = paper_rig();
  setup->calibration->report.projector_serial = "Maker Model 17";
  setup->other_hardware = other_hardware;
  return setup;
}

class HardwareGuardTest : public ::testing::Test {
 protected:
  HardwareGuardTest() {
    auto projector = std::make_unique<ReplacedProjector>("17");
    projector_ = projector.get();
    ScanOptions options;
    options.reopen_first_ms = options.reopen_longest_ms = 1;
    rig_ = std::make_unique<Rig>(std::move(projector), std::vector<std::unique_ptr<Camera>>(),
                                 Grey8(kWidthPx, kHeightPx), options);
    show();
  }
  void show() { EXPECT_TRUE(rig_->release(std::chrono::steady_clock::now() + 30s)); }

  ReplacedProjector* projector_ = nullptr;
  std::unique_ptr<Rig> rig_;
  HardwareGuard guard_;
};

TEST_F(HardwareGuardTest, RefusesAProjectorThatWasReplacedUntilItIsBack) {
  const auto setup = calibrated(OtherHardware::kError);
  EXPECT_TRUE(guard_.check(setup, *rig_));
  projector_->replace("18");
  show();
  for (int i = 0; i < 2; ++i) {
    const auto other = guard_.check(setup, *rig_);
    ASSERT_FALSE(other);
    EXPECT_EQ(other.error().code, ErrorCode::kMismatch);
    EXPECT_EQ(other.error().where, "projector");
  }
  projector_->replace("17");
  show();
  EXPECT_TRUE(guard_.check(setup, *rig_));
}

TEST_F(HardwareGuardTest, OnlyWarnsWhereTheConfigurationSaysSo) {
  projector_->replace("18");
  show();
  EXPECT_TRUE(guard_.check(calibrated(OtherHardware::kWarn), *rig_));
  EXPECT_FALSE(guard_.check(calibrated(OtherHardware::kError), *rig_));
}

TEST_F(HardwareGuardTest, TakesAnythingWithoutACalibration) {
  projector_->replace("18");
  show();
  EXPECT_TRUE(guard_.check(std::make_shared<ScanSetup>(), *rig_));
}

}  // namespace
}  // namespace slsd
