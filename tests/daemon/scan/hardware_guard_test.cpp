// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/hardware_guard.hpp"

#include <chrono>
#include <utility>

#include <gtest/gtest.h>

#include "drivers/projector/headless_projector.hpp"
#include "tests/core/geometry/paper_rig.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;

constexpr int kWidthPx = 96;
constexpr int kHeightPx = 64;

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
