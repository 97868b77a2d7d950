// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/rig/rig.hpp"

#include <thread>

#include <gmock/gmock.h>

#include "daemon/scan/cloud/reconstruct.hpp"
#include "drivers/camera/frame_image.hpp"
#include "drivers/projector/headless_projector.hpp"
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

  /// A rig, and the decoders of its cameras.
  struct Bench {
    std::unique_ptr<Rig> rig;
    ScanSetup setup;

    Result<ScanResult> scan(std::chrono::milliseconds time, const std::string& id = "1") {
      const ScanRequest request{steady_clock::now() + time, false, {}};
      const auto set = rig->capture(request.deadline);
      if (!set) return tl::unexpected(set.error());
      return reconstruct(*set, setup, 0, request, id);
    }
  };

  static ScanSetup setup_for(std::size_t cameras) {
    Calibration calibration = *calibration_;
    calibration.cameras.resize(1);
    while (calibration.cameras.size() < cameras) calibration.cameras.push_back(calibration.cameras[0]);
    ScanSetup setup{*pattern_, draw_pattern(*pattern_), calibration, {}, {}};
    setup.lanes.resize(1);
    for (std::size_t i = 0; i < cameras; ++i) {
      setup.camera_names.push_back("camera" + std::to_string(i));
      setup.lanes[0].push_back(std::move(*Decoder::create(*pattern_, calibration, i, {})));
    }
    return setup;
  }

  static Bench bench_on(std::vector<std::unique_ptr<Camera>> cameras, int exposure_skew_ms = 1000) {
    const ScanOptions options{
        .timeout_ms = 5000, .exposure_skew_ms = exposure_skew_ms, .reopen_first_ms = 1, .reopen_longest_ms = 5};
    ScanSetup setup = setup_for(cameras.size());
    auto projector = std::make_unique<HeadlessProjector>(HeadlessProjectorOptions{});
    projector_ = projector.get();
    auto rig = std::make_unique<Rig>(std::move(projector), std::move(cameras), setup.image, options);
    return {std::move(rig), std::move(setup)};
  }

  static Bench bench_of(const std::vector<std::deque<Step>>& scripts, int opens_to_fail = 0) {
    std::vector<std::unique_ptr<Camera>> cameras;
    for (const auto& script : scripts) {
      auto camera = std::make_unique<ScriptedCamera>("camera" + std::to_string(cameras.size()), *frame_, script);
      camera->opens_to_fail = opens_to_fail;
      cameras.push_back(std::move(camera));
    }
    return bench_on(std::move(cameras));
  }

  static Step fails(ErrorCode code) {
    return [code](ScriptedCamera&, MonotonicTime) { return fail(code, "as told"); };
  }
  static Step exposed(std::chrono::milliseconds after_trigger) {
    return [after_trigger](ScriptedCamera& camera, MonotonicTime) -> Result<Frame> {
      return camera.frame(steady_clock::now() + after_trigger);
    };
  }

  static Step pulls_the_projectors_plug() {
    return [](ScriptedCamera& camera, MonotonicTime) -> Result<Frame> {
      projector_->disconnect();
      return camera.frame(steady_clock::now());
    };
  }

  static HeadlessProjector* projector_;  ///< of the rig made last
  static Pattern* pattern_;
  static Calibration* calibration_;
  static Grey8* frame_;
};

HeadlessProjector* RigTest::projector_ = nullptr;
Pattern* RigTest::pattern_ = nullptr;
Calibration* RigTest::calibration_ = nullptr;
Grey8* RigTest::frame_ = nullptr;

TEST_F(RigTest, ScanGivesACloudWithItsNameAndTimes) {
  auto bench = bench_of({{}});
  const auto scan = bench.scan(30s, "run-1");
  ASSERT_TRUE(scan) << to_string(scan.error());
  EXPECT_GT(scan->cloud.points.size(), 2000U);
  EXPECT_EQ(scan->cloud.scan_id, "run-1");
  EXPECT_EQ(scan->cloud.lattice_columns, pattern_->whole_columns());
  EXPECT_THAT(scan->cloud.time, ::testing::MatchesRegex("20..-..-..T..:..:..\\....Z"));
  EXPECT_EQ(scan->regions[static_cast<std::size_t>(RegionStatus::kDecoded)], scan->cloud.points.size());
  EXPECT_GT(scan->decode_time, 0ns);
}

TEST_F(RigTest, ScanRefusesAFrameExposedBeforeTheTrigger) {
  auto bench = bench_of({{exposed(-200ms)}});
  const auto scan = bench.scan(30s);
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().code, ErrorCode::kFrameStale);
  EXPECT_EQ(scan.error().where, "camera camera0");
  EXPECT_TRUE(bench.scan(30s, "2"));
}

TEST_F(RigTest, ScanRefusesAFrameThatCameTooLate) {
  auto bench = bench_of({{[](ScriptedCamera& camera, MonotonicTime deadline) -> Result<Frame> {
    std::this_thread::sleep_until(deadline + 20ms);
    return camera.frame(deadline - 1ms);
  }}});
  const auto scan = bench.scan(500ms);
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().code, ErrorCode::kFrameLate);
}

TEST_F(RigTest, ScanHandsTheCamerasErrorOn) {
  for (const ErrorCode code : {ErrorCode::kFrameDropped, ErrorCode::kFrameTorn, ErrorCode::kFrameLate}) {
    auto bench = bench_of({{fails(code)}});
    const auto scan = bench.scan(30s);
    ASSERT_FALSE(scan);
    EXPECT_EQ(scan.error().code, code);
    EXPECT_TRUE(bench.scan(30s, "2"));
  }
}

TEST_F(RigTest, ScanOfTwoCamerasIsOneCloud) {
  auto bench = bench_of({{}, {}});
  const auto scan = bench.scan(30s);
  ASSERT_TRUE(scan) << to_string(scan.error());
  EXPECT_EQ(scan->cloud.cameras, 2);
  EXPECT_TRUE(std::ranges::any_of(scan->cloud.points, [](const CloudPoint& point) { return point.camera == 0; }));
  EXPECT_TRUE(std::ranges::any_of(scan->cloud.points, [](const CloudPoint& point) { return point.camera == 1; }));
}

TEST_F(RigTest, ScanRefusesExposuresThatAreApart) {
  auto bench = bench_of({{}, {exposed(5s)}});
  const auto scan = bench.scan(30s);
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().code, ErrorCode::kFrameSkewed);
  EXPECT_THAT(scan.error().message, HasSubstr("ms after camera camera0"));
  EXPECT_THAT(scan.error().message, HasSubstr("exposure_skew_ms"));
}

TEST_F(RigTest, OneCamerasErrorIsTheScans) {
  auto bench = bench_of({{}, {fails(ErrorCode::kFrameDropped)}});
  const auto scan = bench.scan(30s);
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().code, ErrorCode::kFrameDropped);
  EXPECT_EQ(scan.error().where, "camera camera1");
}

TEST_F(RigTest, ScanWaitsForACameraThatOpensLate) {
  auto bench = bench_of({{}}, /*opens_to_fail=*/4);
  EXPECT_TRUE(bench.scan(30s));
  EXPECT_EQ(bench.rig->camera_statuses().at(0).opened, 1U);
}

TEST_F(RigTest, ScanTellsWhyACameraDoesNotOpen) {
  auto bench = bench_of({{}}, /*opens_to_fail=*/1'000'000);
  EXPECT_TRUE(bench.rig->release(std::chrono::steady_clock::now() + 30s));  // the projector is not what it waits for
  const auto scan = bench.scan(1s);
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().code, ErrorCode::kTimeout);
  EXPECT_THAT(scan.error().message, HasSubstr("no such device"));
}

TEST_F(RigTest, DisconnectedCameraIsOpenedAgain) {
  auto bench = bench_of({{fails(ErrorCode::kDisconnected)}});
  EXPECT_FALSE(bench.scan(30s));
  EXPECT_TRUE(bench.scan(30s, "2"));
  EXPECT_EQ(bench.rig->camera_statuses().at(0).opened, 2U);
  EXPECT_EQ(bench.rig->camera_statuses().at(0).frames_lost, 1U);
}

TEST_F(RigTest, ScanThatLosesTheProjectorFails) {
  auto bench = bench_of({{pulls_the_projectors_plug()}});
  const auto scan = bench.scan(30s);
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().code, ErrorCode::kDisconnected);
  EXPECT_TRUE(bench.scan(30s, "2"));
  EXPECT_EQ(bench.rig->projector_status().opened, 2U);
}

TEST_F(RigTest, ProjectorLostWhileNobodyScansIsOpenedAgain) {
  auto bench = bench_of({{}});
  const auto supervise_until_shown = [&] {  // one call takes a tenth of a second at most, opening may take longer
    do bench.rig->supervise();
    while (bench.rig->projector_status().shows != "pattern");
  };
  supervise_until_shown();
  projector_->disconnect();
  bench.rig->supervise();
  supervise_until_shown();
  EXPECT_EQ(bench.rig->projector_status().opened, 2U);
  EXPECT_EQ(projector_->read_back(), draw_pattern(*pattern_));
}

TEST_F(RigTest, StopEndsAScanThatWaits) {
  auto bench = bench_of({{}}, /*opens_to_fail=*/1'000'000);
  std::jthread stopper([&] {
    std::this_thread::sleep_for(50ms);
    bench.rig->request_stop();
  });
  const auto scan = bench.scan(600s);
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().code, ErrorCode::kCancelled);
}

TEST_F(RigTest, ScanWithoutCalibrationSaysSo) {
  const ScanSetup setup{*pattern_, draw_pattern(*pattern_), std::nullopt, {"left", "right"}, {}};
  const auto possible = setup.check({steady_clock::now(), false, {}});
  ASSERT_FALSE(possible);
  EXPECT_THAT(possible.error().message, HasSubstr("[calibration] file"));
}

TEST_F(RigTest, SetupKnowsItsCameras) {
  const ScanSetup setup = setup_for(2);
  EXPECT_TRUE(setup.check({steady_clock::now(), true, "camera1"}));
  EXPECT_EQ(setup.camera_index("camera1"), 1U);
  EXPECT_EQ(setup.camera_index(""), 0U);
  ScanSetup with_texture = setup_for(2);
  with_texture.texture_cameras = 1;
  EXPECT_TRUE(with_texture.check({steady_clock::now(), true, "camera0"}));
  const auto texture = with_texture.check({steady_clock::now(), true, "camera1"});
  ASSERT_FALSE(texture);
  EXPECT_EQ(texture.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(texture.error().message, HasSubstr("use = \"texture\""));
  const auto unknown = setup.check({steady_clock::now(), true, "left"});
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().message, HasSubstr("camera0, camera1"));
}

// It is not waited for, and its exposure may lie apart.
TEST_F(RigTest, TextureCameraExposesForColourAlone) {
  const auto late = [](ScriptedCamera& camera, MonotonicTime) -> Result<Frame> {
    std::this_thread::sleep_for(60ms);
    return camera.frame(steady_clock::now());
  };
  std::vector<std::unique_ptr<Camera>> cameras;
  cameras.push_back(std::make_unique<ScriptedCamera>("grey", *frame_));
  auto texture = std::make_unique<ScriptedCamera>("texture", *frame_, std::deque<Step>{late, late, late});
  ScriptedCamera& of_texture = *texture;
  cameras.push_back(std::move(texture));
  const ScanOptions options{.timeout_ms = 5000, .exposure_skew_ms = 40, .reopen_first_ms = 1, .reopen_longest_ms = 5};
  Rig rig(std::make_unique<HeadlessProjector>(HeadlessProjectorOptions{}), std::move(cameras), draw_pattern(*pattern_),
          options, {}, 1);
  const MonotonicTime deadline = steady_clock::now() + 30s;
  for (const LightFrames light : {LightFrames{}, {.white = true}, {.white = true, .dark = true}}) {
    const auto set = rig.capture(deadline, Exposure::kFresh, light);
    ASSERT_TRUE(set) << to_string(set.error());
    EXPECT_EQ(set->frames.size(), 1U);
    EXPECT_EQ(set->white.size(), light.white ? 1U : 0U);
    EXPECT_EQ(set->dark.size(), light.dark ? 1U : 0U);
  }
  EXPECT_EQ(of_texture.captures, 0);
  const auto set = rig.capture(deadline, Exposure::kFresh, {.white = true, .dark = true, .colour = true});
  ASSERT_TRUE(set) << to_string(set.error());
  EXPECT_EQ(set->frames.size(), 1U);
  EXPECT_EQ(set->white.size(), 2U);
  EXPECT_EQ(set->dark.size(), 2U);
  EXPECT_EQ(of_texture.captures, 2);
  of_texture.gone = true;
  EXPECT_TRUE(rig.capture(deadline, Exposure::kFresh, {.white = true}));
}

TEST_F(RigTest, OneCameraMayBeCapturedAlone) {
  auto bench = bench_of({{fails(ErrorCode::kFrameTorn)}, {}});
  const auto frame = bench.rig->capture_one(1, steady_clock::now() + 30s);
  ASSERT_TRUE(frame) << to_string(frame.error());
  EXPECT_EQ(raw_of(*frame)->bytes, std::string(reinterpret_cast<const char*>(frame_->data()), frame_->size()));
}

}  // namespace
}  // namespace slsd
