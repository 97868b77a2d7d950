// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/rig/camera_runner.hpp"

#include <future>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <gmock/gmock.h>

#include "tests/daemon/scan/scripted_camera.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using Step = ScriptedCamera::Step;

constexpr ScanOptions kOptions{
    .timeout_ms = 5000, .exposure_skew_ms = 100, .reopen_first_ms = 1, .reopen_longest_ms = 5};

const Grey8& picture() {
  static const Grey8 grey(8, 8);
  return grey;
}

/// A runner and the camera that it has.
struct Watched {
  explicit Watched(std::deque<Step> script = {}, bool gone = false,
                   std::optional<std::shared_future<void>> configured = {}) {
    auto made = std::make_unique<ScriptedCamera>("left", picture(), std::move(script));
    made->gone = gone;
    made->configured = std::move(configured);
    camera = made.get();
    runner = std::make_unique<CameraRunner>(std::move(made), kOptions);
  }
  Result<Frame> capture(std::chrono::milliseconds time) {
    if (auto ready = runner->wait_ready(steady_clock::now() + 30s); !ready) return tl::unexpected(ready.error());
    runner->begin_capture(steady_clock::now() + time);
    return end_capture(time);
  }
  /// As the rig does it.
  Result<Frame> end_capture(std::chrono::milliseconds time) {
    const WaitLimit limit(steady_clock::now() + time);
    if (!runner->wait_captured(limit, limit.deadline)) runner->cancel_capture();
    (void)runner->wait_captured(limit, steady_clock::now() + 100ms);
    return runner->end_capture();
  }
  void wait_for(DeviceState state) const {
    while (runner->status().state != state) std::this_thread::sleep_for(100us);
  }

  ScriptedCamera* camera = nullptr;
  std::unique_ptr<CameraRunner> runner;
};

std::unique_ptr<ScriptedCamera> another(const std::string& device, std::optional<ErrorCode> error = {}) {
  auto made = std::make_unique<ScriptedCamera>(device, picture());
  made->open_error = error;
  return made;
}

TEST(CameraRunner, PutsAnotherInThePlaceOfACameraOrLeavesItAsItWas) {
  Watched run;
  ASSERT_TRUE(run.capture(5s));
  ASSERT_TRUE(run.runner->replace(another("a"), another("b"), steady_clock::now() + 5s));
  EXPECT_TRUE(run.capture(5s));
  const auto refused =
      run.runner->replace(another("c", ErrorCode::kInvalidArgument), another("d"), steady_clock::now() + 5s);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(refused.error().where, "camera left");
  EXPECT_EQ(run.runner->status().state, DeviceState::kReady);  // d
  EXPECT_TRUE(run.capture(5s));
}

// It gets the other settings when it is there again: nobody could be told now that it refuses them.
TEST(CameraRunner, PutsAnotherInThePlaceOfACameraThatIsNotThere) {
  Watched run({}, true);
  run.wait_for(DeviceState::kAbsent);
  auto next = another("a");
  next->gone = true;
  ScriptedCamera* const now = next.get();
  ASSERT_TRUE(run.runner->replace(std::move(next), another("b"), steady_clock::now() + 5s));
  now->gone = false;
  run.wait_for(DeviceState::kReady);
  EXPECT_TRUE(run.capture(5s));
}

TEST(CameraRunner, TakesBackASettingThatCameTooLate) {
  Watched run;
  ASSERT_TRUE(run.capture(5s));
  std::promise<void> configured;
  auto slow = another("slow");
  slow->configured = configured.get_future().share();
  auto otherwise = another("otherwise");
  const ScriptedCamera* const back = otherwise.get();
  const auto late = run.runner->replace(std::move(slow), std::move(otherwise), steady_clock::now() + 500ms);
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().code, ErrorCode::kTimeout);
  configured.set_value();
  ASSERT_TRUE(run.capture(5s));
  EXPECT_EQ(back->opens, 1);
  EXPECT_EQ(back->captures, 1);
}

TEST(CameraRunner, NoticesAnIdleCameraThatIsGoneAndOpensItWhenItIsBack) {
  Watched run;
  ASSERT_TRUE(run.runner->wait_ready(steady_clock::now() + 30s));
  run.camera->gone = true;
  run.wait_for(DeviceState::kAbsent);
  EXPECT_THAT(run.runner->status().problem, ::testing::HasSubstr("unplugged"));
  run.camera->gone = false;
  EXPECT_TRUE(run.capture(30s));
  EXPECT_EQ(run.runner->status().opened, 2U);
  EXPECT_EQ(run.runner->status().problem, "");
}

TEST(CameraRunner, TellsAnAbsentCameraFromAFaultedOne) {
  Watched run({[](ScriptedCamera& camera, MonotonicTime) -> Result<Frame> {
                camera.open_error = std::optional(ErrorCode::kPermissionDenied);
                return fail(ErrorCode::kDisconnected, "as told");
              }},
              /*gone=*/true);
  run.wait_for(DeviceState::kAbsent);
  run.camera->gone = false;
  EXPECT_FALSE(run.capture(30s));
  run.wait_for(DeviceState::kFaulted);
  run.camera->open_error = std::nullopt;
  run.wait_for(DeviceState::kReady);
}

TEST(CameraRunner, IsAbsentUntilSomethingAnswersAndThenOpening) {
  std::promise<void> configured;
  Watched run({}, /*gone=*/true, configured.get_future().share());
  run.wait_for(DeviceState::kAbsent);
  for (const int enough = run.camera->opens + 5; run.camera->opens < enough;)
    ASSERT_EQ(run.runner->status().state, DeviceState::kAbsent);
  run.camera->gone = false;
  run.wait_for(DeviceState::kOpening);
  configured.set_value();
  run.wait_for(DeviceState::kReady);
}

TEST(CameraRunner, PromisesToBeHeardOfAsSoonAsItsCameraMayTakeToOpen) {
  std::promise<void> configured;
  auto camera = std::make_unique<ScriptedCamera>("left", picture());
  camera->open_time = 10min;
  camera->configured = configured.get_future().share();
  const std::atomic<int>& opens = camera->opens;
  const CameraRunner runner(std::move(camera), kOptions);
  while (opens == 0) std::this_thread::sleep_for(100us);
  EXPECT_TRUE(runner.heartbeat().kept(steady_clock::now() + 9min));
  EXPECT_FALSE(runner.heartbeat().kept(steady_clock::now() + 11min));
  configured.set_value();
}

TEST(CameraRunner, PromisesToBeHeardOfAfterThePauseBetweenTwoAttempts) {
  auto camera = std::make_unique<ScriptedCamera>("left", picture());
  camera->gone = true;
  ScanOptions options = kOptions;
  options.reopen_first_ms = options.reopen_longest_ms = 600'000;
  const CameraRunner runner(std::move(camera), options);
  const auto promises = [&] { return runner.heartbeat().kept(steady_clock::now() + 9min); };
  for (const auto end = steady_clock::now() + 30s; !promises() && steady_clock::now() < end;)
    std::this_thread::sleep_for(1ms);
  EXPECT_TRUE(promises());
}

TEST(CameraRunner, OpensAgainAtOnceWhereOpeningWasCancelled) {
  auto camera = std::make_unique<ScriptedCamera>("left", picture());
  camera->open_error = std::optional(ErrorCode::kCancelled);
  ScriptedCamera& scripted = *camera;
  CameraRunner runner(std::move(camera), kOptions);
  while (scripted.opens < 3) std::this_thread::sleep_for(100us);
  EXPECT_EQ(runner.status().problem, "");
  scripted.open_error = std::nullopt;
  EXPECT_TRUE(runner.wait_ready(steady_clock::now() + 30s));
}

TEST(CameraRunner, IsCapturingWhileAFrameIsUnderWay) {
  std::promise<void> expose;
  Watched run({[&](ScriptedCamera& camera, MonotonicTime) -> Result<Frame> {
    expose.get_future().wait();
    return camera.frame(steady_clock::now());
  }});
  ASSERT_TRUE(run.runner->wait_ready(steady_clock::now() + 30s));
  run.runner->begin_capture(steady_clock::now() + 30s);
  run.wait_for(DeviceState::kCapturing);
  expose.set_value();
  EXPECT_TRUE(run.end_capture(30s));
  EXPECT_EQ(run.runner->status().state, DeviceState::kReady);
}

TEST(CameraRunner, GivesUpADriverThatDoesNotAnswerAndTakesItsFrameForNobodys) {
  std::promise<void> answer;
  Watched run({[&](ScriptedCamera& camera, MonotonicTime) -> Result<Frame> {
    answer.get_future().wait();
    return camera.frame(steady_clock::now());
  }});
  const auto stuck = run.capture(10ms);
  ASSERT_FALSE(stuck);
  EXPECT_EQ(stuck.error().code, ErrorCode::kDisconnected);
  EXPECT_EQ(stuck.error().where, "camera left");
  EXPECT_EQ(run.runner->status().state, DeviceState::kFaulted);
  answer.set_value();
  const auto frame = run.capture(30s);
  ASSERT_TRUE(frame) << to_string(frame.error());
  EXPECT_EQ(frame->sequence(), 1U);
  EXPECT_EQ(run.runner->status().opened, 2U);
}

TEST(CameraRunner, CountsFramesThatAreMissingBetweenTwo) {
  const auto skip = [](ScriptedCamera& camera, MonotonicTime) -> Result<Frame> {
    camera.skip_frames(3);
    return camera.frame(steady_clock::now());
  };
  const auto lose = [](ScriptedCamera& camera, MonotonicTime) -> Result<Frame> {
    camera.skip_frames(1);
    return fail(ErrorCode::kFrameTorn, "as told");
  };
  const auto busy = [](ScriptedCamera&, MonotonicTime) -> Result<Frame> { return fail(ErrorCode::kBusy, "as told"); };
  Watched run({skip, skip, lose, busy});
  for (int i = 0; i < 5; ++i) (void)run.capture(30s);
  EXPECT_EQ(run.runner->status().frames, 3U);
  EXPECT_EQ(run.runner->status().frames_lost, 4U);
}

TEST(CameraRunner, StopEndsItSoonAndClosesTheCamera) {
  Watched run;
  ASSERT_TRUE(run.runner->wait_ready(steady_clock::now() + 30s));
  run.runner->request_stop();
  while (!run.runner->stopped()) std::this_thread::sleep_for(1ms);
  EXPECT_EQ(run.runner->wait_ready(steady_clock::now() + 30s).error().code, ErrorCode::kCancelled);
}

TEST(SequenceGaps, CountsWhatNoErrorToldOf) {
  SequenceGaps gaps;
  EXPECT_EQ(gaps.note_frame(5), 0U);
  EXPECT_EQ(gaps.note_frame(6), 0U);
  EXPECT_EQ(gaps.note_frame(9), 2U);
  gaps.note_failure();
  EXPECT_EQ(gaps.note_frame(11), 0U);
  gaps.note_failure();  // of a frame that the device does not number
  EXPECT_EQ(gaps.note_frame(12), 0U);
  EXPECT_EQ(gaps.note_frame(14), 1U);
  gaps.restart();
  EXPECT_EQ(gaps.note_frame(0), 0U);
}

}  // namespace
}  // namespace slsd
