// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/scan.hpp"

#include <future>
#include <memory>
#include <optional>
#include <stop_token>
#include <utility>

#include <gmock/gmock.h>

#include "daemon/scan/deadlines.hpp"
#include "daemon/scan/scanner.hpp"
#include "drivers/projector/headless_projector.hpp"
#include "tests/daemon/scan/scripted_camera.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using ::testing::HasSubstr;
using Step = ScriptedCamera::Step;
using Outcome = std::future<Result<ScanResult>>;

Step fails(ErrorCode code) {
  return [code](ScriptedCamera&, MonotonicTime) { return fail(code, "as told"); };
}

/// A driver that comes back when it is let go, and not before.
Step hangs(const std::shared_future<void>& let_go) {
  return [let_go](ScriptedCamera&, MonotonicTime) {
    let_go.wait();
    return fail(ErrorCode::kFrameDropped, "long ago");
  };
}

/// A scanner on a camera that does as it is told; what it sees has no symbols in it, so that clouds are empty and soon
/// there.
class ScanTest : public ::testing::Test {
 protected:
  void make(std::deque<Step> script, bool gone = false) {
    auto camera = std::make_unique<ScriptedCamera>("left", black_, std::move(script));
    camera->gone = gone;
    camera_ = camera.get();
    const Pattern pattern = *make_pattern({});
    const Calibration calibration = [] {
      Calibration made;
      made.cameras.resize(1);
      made.cameras[0].name = "left";
      return made;
    }();
    ScanSetup setup{pattern, draw_pattern(pattern), calibration, {"left"}, {}};
    std::vector<std::unique_ptr<Camera>> cameras;
    cameras.push_back(std::move(camera));
    const ScanOptions options{.timeout_ms = 5000, .reopen_first_ms = 1, .reopen_longest_ms = 5};
    auto rig = std::make_unique<Rig>(std::make_unique<HeadlessProjector>(HeadlessProjectorOptions{}),
                                     std::move(cameras), setup.image, options);
    scanner_ = std::make_unique<Scanner>(std::move(rig), std::move(setup));
  }
  /// A scan that is waited for no longer is not decoded: there are no decoders here.
  void TearDown() override {
    gone_.request_stop();
    let_go_.set_value();
    scanner_.reset();
  }

  Outcome scan(std::chrono::milliseconds time) { return scan(time, gone_.get_token()); }
  Outcome scan(std::chrono::milliseconds time, const std::stop_token& gone) {
    auto answer = std::make_shared<std::promise<Result<ScanResult>>>();
    ScanRequest request;
    request.deadline = steady_clock::now() + time;
    request.gone = gone;
    scanner_->scan(std::move(request), [answer](Result<ScanResult> result) { answer->set_value(std::move(result)); });
    return answer->get_future();
  }

  /// Frames need no decoder: only how they are come by is of interest here.
  std::future<Result<FrameImage>> frame(std::chrono::milliseconds time) {
    auto answer = std::make_shared<std::promise<Result<FrameImage>>>();
    FrameRequest request;
    request.deadline = steady_clock::now() + time;
    request.as_png = false;
    scanner_->frame(std::move(request), [answer](Result<FrameImage> image) { answer->set_value(std::move(image)); });
    return answer->get_future();
  }

  void wait_for_capture() {
    while (scanner_->rig().camera_statuses().at(0).state != DeviceState::kCapturing) std::this_thread::sleep_for(1ms);
  }

  std::stop_source gone_;
  std::promise<void> let_go_;
  const std::shared_future<void> let_go_of_ = let_go_.get_future().share();
  const Grey8 black_{64, 48};
  ScriptedCamera* camera_ = nullptr;
  std::unique_ptr<Scanner> scanner_;
};

TEST_F(ScanTest, TakesLostFramesAgain) {
  make({fails(ErrorCode::kFrameDropped), fails(ErrorCode::kFrameTorn), fails(ErrorCode::kFrameLate)});
  const auto image = frame(60s).get();
  EXPECT_TRUE(image) << to_string(image.error());
  EXPECT_EQ(scanner_->rig().camera_statuses().at(0).frames_lost, 3U);
}

TEST_F(ScanTest, TellsOfAllTriesWhereNoneSucceeded) {
  make({fails(ErrorCode::kFrameTorn), fails(ErrorCode::kFrameDropped), fails(ErrorCode::kMismatch)});
  const auto result = scan(60s).get();
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::kMismatch);
  EXPECT_THAT(result.error().message, HasSubstr("3 tries; the error before: frame_dropped"));
}

TEST_F(ScanTest, NamesWhatHappenedAndNotThatTheTimeWasOver) {
  make({fails(ErrorCode::kFrameTorn), [](ScriptedCamera&, MonotonicTime deadline) -> Result<Frame> {
          std::this_thread::sleep_until(deadline);
          return fail(ErrorCode::kFrameLate, "as told");
        }});
  const auto result = scan(300ms).get();
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::kFrameTorn);
}

TEST_F(ScanTest, IsNotTriedAgainWhereTheCameraIsGone) {
  make({fails(ErrorCode::kDisconnected)});
  const auto result = scan(60s).get();
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::kDisconnected);
}

TEST_F(ScanTest, OneThatLosesEveryFrameEndsAtItsDeadline) {
  make(std::deque<Step>(10'000, fails(ErrorCode::kFrameDropped)));
  const auto result = scan(300ms).get();
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::kFrameDropped);
  EXPECT_LT(camera_->captures, 100);  // pauses between tries
}

TEST_F(ScanTest, FreeRunTellsOfEachLostFrame) {
  make(std::deque<Step>(10'000, fails(ErrorCode::kFrameDropped)));
  const auto first = std::make_shared<std::promise<std::optional<ErrorCode>>>();  // the scanner outlives this test
  scanner_->set_listener([first, told = false](const FreeScan& scan) mutable {
    if (!std::exchange(told, true)) first->set_value(*scan ? std::nullopt : std::optional(scan->error().code));
  });
  scanner_->run_freely(FreeRun{1000, {}});
  EXPECT_EQ(first->get_future().get(), ErrorCode::kFrameDropped);
  scanner_->run_freely(std::nullopt);
}

TEST_F(ScanTest, EndsWhenItsClientHangsUp) {
  make({}, /*gone=*/true);
  std::stop_source gone;
  auto waiting = scan(600s, gone.get_token());
  gone.request_stop();
  const auto result = waiting.get();
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::kCancelled);
  camera_->gone = false;
  EXPECT_TRUE(frame(600s).get());  // nothing of the 600 s of before is waited for
}

TEST_F(ScanTest, HangUpEndsACaptureAndTheNextIsWhole) {
  make({[](ScriptedCamera& camera, MonotonicTime deadline) { return camera.wait_cancelled(deadline); }});
  std::stop_source gone;
  auto waiting = scan(600s, gone.get_token());
  wait_for_capture();
  gone.request_stop();
  EXPECT_EQ(waiting.get().error().code, ErrorCode::kCancelled);
  EXPECT_TRUE(frame(60s).get());
}

TEST_F(ScanTest, WaitsForItsTurnNoLongerThanItsDeadlineAndNamesTheDevice) {
  make({}, /*gone=*/true);
  auto first = scan(600s);
  const auto begin = steady_clock::now();
  const auto second = scan(200ms).get();
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::kTimeout);
  EXPECT_EQ(second.error().where, "camera left");
  EXPECT_THAT(second.error().message, HasSubstr("unplugged"));
  EXPECT_LT(steady_clock::now() - begin, 60s);
  EXPECT_EQ(first.wait_for(0s), std::future_status::timeout);
}

TEST_F(ScanTest, EndsSoonAfterItsDeadlineWhereADriverHangs) {
  make({hangs(let_go_of_)});
  const auto result = scan(200ms).get();
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::kDisconnected);
  EXPECT_EQ(result.error().where, "camera left");
  EXPECT_EQ(scanner_->rig().camera_statuses().at(0).state, DeviceState::kFaulted);
}

TEST_F(ScanTest, ADriverThatHangsBreaksItsPromiseWhateverTheClientsTimeout) {
  make({hangs(let_go_of_)});
  camera_->frame_time = 50ms;
  auto waiting = scan(600s);
  wait_for_capture();
  EXPECT_TRUE(scanner_->kept());
  EXPECT_FALSE(scanner_->rig().kept(steady_clock::now() + 20s));
}

TEST_F(ScanTest, NothingThatNeedsNoDeviceWaitsForOne) {
  make({}, /*gone=*/true);
  auto waiting = scan(600s);
  std::promise<Result<std::string>> pattern;
  scanner_->pattern([&](Result<std::string> png) { pattern.set_value(std::move(png)); });
  EXPECT_TRUE(pattern.get_future().get());
  EXPECT_FALSE(scanner_->setup()->files().pattern.empty());
  EXPECT_EQ(waiting.wait_for(0s), std::future_status::timeout);
}

TEST_F(ScanTest, ThoseThatAreOverGiveTheirPlaceToOthers) {
  make({}, /*gone=*/true);
  auto first = scan(600s);
  for (int i = 0; i < 200; ++i) {
    std::stop_source gone;
    auto waiting = scan(600s, gone.get_token());
    gone.request_stop();
    EXPECT_EQ(waiting.get().error().code, ErrorCode::kCancelled);
  }
  EXPECT_EQ(scan(1ms).get().error().code, ErrorCode::kTimeout);
}

TEST_F(ScanTest, StopAnswersTheOneThatWaitsForADeviceAndAllBehindIt) {
  make({}, /*gone=*/true);
  std::vector<Outcome> waiting;
  for (int i = 0; i < 5; ++i) waiting.push_back(scan(600s));
  scanner_->request_stop();
  for (Outcome& each : waiting) EXPECT_EQ(each.get().error().code, ErrorCode::kCancelled);
  EXPECT_TRUE(scanner_->wait_stopped(60s));
  EXPECT_EQ(scan(600s).get().error().code, ErrorCode::kCancelled);
}

TEST(Task, EndsOnce) {
  int answers = 0;
  auto task = std::make_shared<TaskOf<int>>(MonotonicTime::max(), [&](Result<int>) { ++answers; });
  EXPECT_FALSE(task->over());
  task->end(1);
  task->end(2);
  task->fail_with({ErrorCode::kTimeout, "late", {}});
  EXPECT_TRUE(task->over());
  EXPECT_EQ(answers, 1);
}

TEST(Task, EndsAtOnceWhereItsClientIsGoneAlready) {
  std::stop_source gone;
  gone.request_stop();
  std::optional<Result<int>> answer;
  auto task = std::make_shared<TaskOf<int>>(MonotonicTime::max(), [&](Result<int> value) { answer = value; });
  task->end_with(gone.get_token());
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->error().code, ErrorCode::kCancelled);
}

TEST(Deadlines, EndEachTaskInItsTime) {
  std::vector<int> ended;
  std::promise<void> all;
  Deadlines deadlines([](const Task&) { return Error{ErrorCode::kTimeout, "as told", {}}; });
  std::vector<std::shared_ptr<Task>> tasks;
  const auto now = steady_clock::now();
  for (const int ms : {90, 30, 60}) {
    tasks.push_back(std::make_shared<TaskOf<int>>(now + std::chrono::milliseconds(ms), [&, ms](Result<int> value) {
      EXPECT_EQ(value.error().code, ErrorCode::kTimeout);
      EXPECT_GE(steady_clock::now(), now + std::chrono::milliseconds(ms));
      ended.push_back(ms);
      if (ended.size() == 3) all.set_value();
    }));
    deadlines.watch(tasks.back());
  }
  all.get_future().wait();
  EXPECT_THAT(ended, ::testing::ElementsAre(30, 60, 90));
}

}  // namespace
}  // namespace slsd
