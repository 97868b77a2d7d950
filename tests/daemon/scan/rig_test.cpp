// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/rig.hpp"

#include <gmock/gmock.h>

#include "daemon/scan/devices.hpp"
#include "tests/daemon/scan/scripted_camera.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using ::testing::HasSubstr;
using Step = ScriptedCamera::Step;

/// A plane 2 m away, seen by one camera or by two at the same place.
class RigTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    pattern_ = new Pattern(*make_pattern({}));
    calibration_ = new Calibration(paper_rig());
    frame_ = new Grey8(simulate(draw_pattern(*pattern_), *calibration_, plane({0, 0, 2000}, {0, 0, 1})));
  }
  static void TearDownTestSuite() {
    delete frame_;
    delete calibration_;
    delete pattern_;
  }

  static ScanSetup setup_for(std::size_t cameras) {
    Calibration calibration = *calibration_;
    calibration.cameras.resize(1);
    while (calibration.cameras.size() < cameras) calibration.cameras.push_back(calibration.cameras[0]);
    ScanSetup setup{*pattern_, draw_pattern(*pattern_), calibration, {}};
    for (std::size_t i = 0; i < cameras; ++i) {
      setup.decoders.push_back(std::move(*Decoder::create(*pattern_, calibration, i, {})));
    }
    return setup;
  }

  static std::unique_ptr<Rig> rig_of(std::vector<std::deque<Step>> scripts, int opens_to_fail = 0) {
    std::vector<std::unique_ptr<Camera>> cameras;
    for (auto& script : scripts) {
      auto camera = std::make_unique<ScriptedCamera>("camera" + std::to_string(cameras.size()), *frame_, script);
      camera->opens_to_fail = opens_to_fail;
      cameras.push_back(std::move(camera));
    }
    const ScanOptions options{
        .timeout_ms = 5000, .exposure_skew_ms = 1000, .reopen_first_ms = 1, .reopen_longest_ms = 5};
    return std::make_unique<Rig>(std::move(*make_projector({})), std::move(cameras), setup_for(scripts.size()),
                                 options);
  }

  static ScanRequest within(std::chrono::milliseconds time) { return {steady_clock::now() + time, false, {}}; }

  static Step fails(ErrorCode code) {
    return [code](ScriptedCamera&, MonotonicTime) { return fail(code, "as told"); };
  }
  static Step exposed(std::chrono::milliseconds after_trigger) {
    return [after_trigger](ScriptedCamera& camera, MonotonicTime) -> Result<Frame> {
      return camera.frame(steady_clock::now() + after_trigger);
    };
  }

  static Pattern* pattern_;
  static Calibration* calibration_;
  static Grey8* frame_;
};

Pattern* RigTest::pattern_ = nullptr;
Calibration* RigTest::calibration_ = nullptr;
Grey8* RigTest::frame_ = nullptr;

TEST_F(RigTest, ScanGivesACloudWithItsNameAndTimes) {
  const auto rig = rig_of({{}});
  const auto scan = rig->scan(within(30s), "run-1");
  ASSERT_TRUE(scan) << to_string(scan.error());
  EXPECT_GT(scan->cloud.points.size(), 2000U);
  EXPECT_EQ(scan->cloud.scan_id, "run-1");
  EXPECT_EQ(scan->cloud.lattice_columns, pattern_->whole_columns());
  EXPECT_THAT(scan->cloud.time, ::testing::MatchesRegex("20..-..-..T..:..:..\\....Z"));
  EXPECT_EQ(scan->regions[static_cast<std::size_t>(RegionStatus::kDecoded)], scan->cloud.points.size());
  EXPECT_GT(scan->decode_time, 0ns);
}

TEST_F(RigTest, ScanRefusesAFrameExposedBeforeTheTrigger) {
  const auto rig = rig_of({{exposed(-200ms)}});
  const auto scan = rig->scan(within(30s), "1");
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().code, ErrorCode::kFrameStale);
  EXPECT_EQ(scan.error().where, "camera camera0");
  EXPECT_TRUE(rig->scan(within(30s), "2"));
}

TEST_F(RigTest, ScanRefusesAFrameThatCameTooLate) {
  const auto rig = rig_of({{[](ScriptedCamera& camera, MonotonicTime deadline) -> Result<Frame> {
    std::this_thread::sleep_until(deadline + 20ms);
    return camera.frame(deadline - 1ms);
  }}});
  const auto scan = rig->scan(within(500ms), "1");
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().code, ErrorCode::kFrameLate);
}

TEST_F(RigTest, ScanHandsTheCamerasErrorOn) {
  for (const ErrorCode code : {ErrorCode::kFrameDropped, ErrorCode::kFrameTorn, ErrorCode::kFrameLate}) {
    const auto rig = rig_of({{fails(code)}});
    const auto scan = rig->scan(within(30s), "1");
    ASSERT_FALSE(scan);
    EXPECT_EQ(scan.error().code, code);
    EXPECT_TRUE(rig->scan(within(30s), "2"));
  }
}

TEST_F(RigTest, ScanOfTwoCamerasIsOneCloud) {
  const auto rig = rig_of({{}, {}});
  const auto scan = rig->scan(within(30s), "1");
  ASSERT_TRUE(scan) << to_string(scan.error());
  EXPECT_EQ(scan->cloud.cameras, 2);
  EXPECT_TRUE(std::ranges::any_of(scan->cloud.points, [](const CloudPoint& point) { return point.camera == 0; }));
  EXPECT_TRUE(std::ranges::any_of(scan->cloud.points, [](const CloudPoint& point) { return point.camera == 1; }));
}

TEST_F(RigTest, ScanRefusesExposuresThatAreApart) {
  const auto rig = rig_of({{}, {exposed(5s)}});
  const auto scan = rig->scan(within(30s), "1");
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().code, ErrorCode::kMismatch);
  EXPECT_THAT(scan.error().message, HasSubstr("exposure_skew_ms"));
}

TEST_F(RigTest, OneCamerasErrorIsTheScans) {
  const auto rig = rig_of({{}, {fails(ErrorCode::kFrameDropped)}});
  const auto scan = rig->scan(within(30s), "1");
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().code, ErrorCode::kFrameDropped);
  EXPECT_EQ(scan.error().where, "camera camera1");
}

TEST_F(RigTest, ScanWaitsForACameraThatOpensLate) {
  const auto rig = rig_of({{}}, /*opens_to_fail=*/4);
  EXPECT_TRUE(rig->scan(within(30s), "1"));
  EXPECT_EQ(rig->camera_statuses().at(0).opened, 1U);
}

TEST_F(RigTest, ScanTellsWhyACameraDoesNotOpen) {
  const auto rig = rig_of({{}}, /*opens_to_fail=*/1'000'000);
  const auto scan = rig->scan(within(300ms), "1");
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().code, ErrorCode::kTimeout);
  EXPECT_THAT(scan.error().message, HasSubstr("no such device"));
}

TEST_F(RigTest, DisconnectedCameraIsOpenedAgain) {
  const auto rig = rig_of({{fails(ErrorCode::kDisconnected)}});
  EXPECT_FALSE(rig->scan(within(30s), "1"));
  EXPECT_TRUE(rig->scan(within(30s), "2"));
  EXPECT_EQ(rig->camera_statuses().at(0).opened, 2U);
  EXPECT_EQ(rig->camera_statuses().at(0).frames_lost, 1U);
}

TEST_F(RigTest, StopEndsAScanThatWaits) {
  const auto rig = rig_of({{}}, /*opens_to_fail=*/1'000'000);
  std::jthread stopper([&] {
    std::this_thread::sleep_for(50ms);
    rig->request_stop();
  });
  const auto scan = rig->scan(within(600s), "1");
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().code, ErrorCode::kCancelled);
}

TEST_F(RigTest, ScanWithoutCalibrationSaysSo) {
  const auto rig = rig_of({{}});
  ScanSetup setup{*pattern_, draw_pattern(*pattern_), std::nullopt, {}};
  rig->replace(std::move(setup));
  const auto scan = rig->scan(within(30s), "1");
  ASSERT_FALSE(scan);
  EXPECT_THAT(scan.error().message, HasSubstr("[calibration] file"));
  EXPECT_TRUE(rig->frame("", true, steady_clock::now() + 30s));
}

TEST_F(RigTest, FrameIsThePixelsAsTheyAre) {
  const auto rig = rig_of({{}});
  const auto frame = rig->frame("camera0", false, steady_clock::now() + 30s);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->bytes, std::string(reinterpret_cast<const char*>(frame_->data()), frame_->size()));
  const auto unknown = rig->frame("left", false, steady_clock::now() + 30s);
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().message, HasSubstr("camera0"));
}

}  // namespace
}  // namespace slsd
