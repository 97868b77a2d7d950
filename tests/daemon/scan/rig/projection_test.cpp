// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/rig/projection.hpp"

#include <chrono>
#include <optional>
#include <thread>

#include <gmock/gmock.h>

#include "drivers/projector/headless_projector.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using ::testing::HasSubstr;

constexpr int kWidthPx = 96;
constexpr int kHeightPx = 64;

Grey8 plain(std::uint8_t value) {
  return Grey8(kWidthPx, kHeightPx, value);
}

class ProjectionTest : public ::testing::Test {
 protected:
  ProjectionTest() { make({}); }

  void make(ScanOptions options) {
    auto projector = std::make_unique<HeadlessProjector>(
        HeadlessProjectorOptions{.width_px = kWidthPx, .height_px = kHeightPx, .refresh_hz = 1000.0});
    projector_ = projector.get();
    options.reopen_first_ms = 1;
    options.reopen_longest_ms = 5;
    projection_ = std::make_unique<Projection>(std::move(projector), plain(100), options);
  }

  Result<> show(Picture picture = Picture::kPattern) { return projection_->show(picture, in(30s), {}); }
  Result<> hold(std::optional<Grey8> picture) { return projection_->hold(std::move(picture), in(30s), {}); }
  /// Until there is nothing left to do: on a busy machine a picture takes more than one step.
  void supervise() {
    do projection_->supervise();
    while (projection_->next_change() <= steady_clock::now());
  }
  Result<> show_due() { return projection_->show_due(in(30s), {}); }
  Grey8 shown() { return *projector_->read_back(); }
  static MonotonicTime in(std::chrono::nanoseconds time) { return steady_clock::now() + time; }

  HeadlessProjector* projector_ = nullptr;
  std::unique_ptr<Projection> projection_;
};

TEST_F(ProjectionTest, ShowsThePatternWhileNobodyScans) {
  supervise();
  EXPECT_EQ(shown(), plain(100));
  EXPECT_EQ(projection_->status().state, DeviceState::kReady);
  EXPECT_EQ(projection_->status().shows, "pattern");
  const auto changes = projection_->changes();
  supervise();
  ASSERT_TRUE(show());
  EXPECT_EQ(projection_->changes(), changes);
  EXPECT_EQ(projection_->next_change(), MonotonicTime::max());
}

TEST_F(ProjectionTest, ShowsTheIdlePictureBetweenScans) {
  projection_->set_idle(plain(7), 0ms);
  supervise();
  EXPECT_EQ(shown(), plain(7));
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(show());
    EXPECT_EQ(shown(), plain(100));
    EXPECT_LE(projection_->next_change(), steady_clock::now());
    supervise();
    EXPECT_EQ(shown(), plain(7));
    EXPECT_EQ(projection_->status().shows, "idle");
    EXPECT_EQ(projection_->next_change(), MonotonicTime::max());
  }
}

TEST_F(ProjectionTest, WaitsAfterAScanWithTheIdlePicture) {
  projection_->set_idle(plain(7), 600s);
  ASSERT_TRUE(show());
  supervise();
  EXPECT_EQ(shown(), plain(100));
  EXPECT_GT(projection_->next_change(), in(500s));
}

TEST_F(ProjectionTest, HoldsAPictureUntilAScan) {
  projection_->set_idle(plain(7), 0ms);
  for (const auto value : {std::uint8_t{1}, std::uint8_t{2}}) {
    ASSERT_TRUE(hold(plain(value)));
    supervise();
    EXPECT_EQ(shown(), plain(value));
    EXPECT_EQ(projection_->status().shows, "held");
  }
  ASSERT_TRUE(show());
  EXPECT_EQ(shown(), plain(100));
  supervise();
  EXPECT_EQ(shown(), plain(7));
}

TEST_F(ProjectionTest, HoldsThePatternAsItIs) {
  projection_->set_idle(plain(7), 0ms);
  ASSERT_TRUE(hold(std::nullopt));
  EXPECT_EQ(shown(), plain(100));
  projection_->set_pattern(plain(200));
  supervise();
  EXPECT_EQ(shown(), plain(200));
  ASSERT_TRUE(projection_->release(in(30s), {}));
  EXPECT_EQ(shown(), plain(7));
}

TEST_F(ProjectionTest, GoesBackToWhatWasHeldWhereAnotherPictureIsNotShownInTime) {
  projection_->set_idle(plain(7), 0ms);
  for (const bool held : {false, true}) {
    if (held) {
      ASSERT_TRUE(hold(plain(1)));
    }
    EXPECT_EQ(projection_->hold(plain(2), in(-1s), {}).error().code, ErrorCode::kTimeout);
    supervise();
    EXPECT_EQ(shown(), plain(held ? 1 : 7));
  }
  EXPECT_EQ(projection_->release(in(-1s), {}).error().code, ErrorCode::kTimeout);
  supervise();
  EXPECT_EQ(shown(), plain(1));
}

TEST_F(ProjectionTest, ShowsWhiteAndBlack) {
  ASSERT_TRUE(show(Picture::kWhite));
  EXPECT_EQ(shown(), plain(255));
  ASSERT_TRUE(show(Picture::kBlack));
  EXPECT_EQ(shown(), plain(0));
  supervise();
  EXPECT_EQ(shown(), plain(100));
}

TEST_F(ProjectionTest, TakesAnotherPattern) {
  ASSERT_TRUE(show());
  projection_->set_pattern(plain(200));
  ASSERT_TRUE(show());
  EXPECT_EQ(shown(), plain(200));
}

TEST_F(ProjectionTest, WaitsAsLongAsTheDeviceIsLate) {
  make({.projector_latency_ms = 50});
  const auto before = steady_clock::now();
  ASSERT_TRUE(show());
  EXPECT_GE(steady_clock::now() - before, 50ms);
  EXPECT_LE(projection_->visible(), steady_clock::now());
  const auto again = projection_->show(Picture::kWhite, in(20ms), {});
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::kTimeout);
}

TEST_F(ProjectionTest, ShowsWhatItShowedWhenItIsBack) {
  ASSERT_TRUE(hold(plain(3)));
  projector_->disconnect();
  EXPECT_EQ(projection_->check(in(30s)).error().code, ErrorCode::kDisconnected);
  ASSERT_TRUE(show_due());
  EXPECT_EQ(shown(), plain(3));
  EXPECT_EQ(projection_->status().opened, 2U);
}

TEST_F(ProjectionTest, TellsWhyThePatternIsNotShown) {
  projection_->set_pattern(Grey8(1, 1));
  const auto shown = projection_->show(Picture::kPattern, in(50ms), {});
  ASSERT_FALSE(shown);
  EXPECT_EQ(shown.error().code, ErrorCode::kTimeout);
  EXPECT_THAT(shown.error().message, HasSubstr("the image is 1x1 pixels"));
  EXPECT_EQ(projection_->status().state, DeviceState::kFaulted);
  EXPECT_EQ(projection_->status().shows, "");
}

/// A projector whose driver takes its time, or hangs.
class SlowProjector final : public Projector {
 public:
  [[nodiscard]] const ProjectorDescription& description() const override { return description_; }
  [[nodiscard]] Result<> open(MonotonicTime deadline) override {
    ++opened;
    return wait(deadline);
  }
  [[nodiscard]] Result<MonotonicTime> show(const Grey8&, MonotonicTime deadline) override {
    if (auto done = wait(deadline); !done) return tl::unexpected(done.error());
    return steady_clock::now();
  }
  [[nodiscard]] Result<> check(MonotonicTime deadline) override { return wait(deadline); }
  [[nodiscard]] std::vector<std::string> warnings() const override { return {}; }
  [[nodiscard]] Result<Grey8> read_back() override { return Grey8(); }

  MonotonicTime ready;  ///< answers nothing before
  bool hangs = false;
  int opened = 0;

 private:
  [[nodiscard]] Result<> wait(MonotonicTime deadline) const {
    if (hangs) return fail(ErrorCode::kIo, "it does not answer", "monitor A");
    std::this_thread::sleep_until(std::min(ready, deadline));
    return ready > deadline ? Result<>(fail(ErrorCode::kTimeout, "it takes longer")) : Result<>();
  }
  ProjectorDescription description_{"slow", "", kWidthPx, kHeightPx};
};

class SlowProjectionTest : public ::testing::Test {
 protected:
  SlowProjectionTest() {
    ScanOptions options;
    options.reopen_first_ms = options.reopen_longest_ms = 1;
    auto projector = std::make_unique<SlowProjector>();
    projector_ = projector.get();
    projection_ = std::make_unique<Projection>(std::move(projector), plain(100), options);
  }

  static MonotonicTime in(std::chrono::nanoseconds time) { return steady_clock::now() + time; }

  SlowProjector* projector_ = nullptr;
  std::unique_ptr<Projection> projection_;
};

TEST_F(SlowProjectionTest, GoesOnWhereOnePictureTookTooLongForAScan) {
  ASSERT_TRUE(projection_->show(Picture::kPattern, in(30s), {}));
  projector_->ready = in(600s);
  const auto shown = projection_->show(Picture::kWhite, in(10ms), {});
  EXPECT_EQ(shown.error().code, ErrorCode::kTimeout);
  EXPECT_EQ(projection_->status().state, DeviceState::kReady) << "it is only slow";
  projector_->ready = in(0s);
  EXPECT_TRUE(projection_->show(Picture::kWhite, in(30s), {}));
  EXPECT_EQ(projector_->opened, 1);
}

TEST_F(SlowProjectionTest, IsFaultedWhileItsDriverHangs) {
  ASSERT_TRUE(projection_->show(Picture::kPattern, in(30s), {}));
  projector_->hangs = true;
  const auto there = projection_->check(in(30s));
  EXPECT_EQ(there.error().code, ErrorCode::kDisconnected);
  EXPECT_EQ(there.error().where, "projector, monitor A");
  const auto shown = projection_->show(Picture::kPattern, in(50ms), {});
  EXPECT_EQ(shown.error().code, ErrorCode::kTimeout);
  EXPECT_THAT(to_string(shown.error()), HasSubstr("projector: the projector did not become ready"));
  EXPECT_THAT(shown.error().message, HasSubstr("it does not answer"));
  EXPECT_EQ(projection_->status().state, DeviceState::kFaulted);
  EXPECT_THAT(projection_->status().problem, HasSubstr("it does not answer"));
  projector_->hangs = false;
  EXPECT_TRUE(projection_->show(Picture::kPattern, in(30s), {}));
  EXPECT_EQ(projection_->status().problem, "");
}

TEST_F(SlowProjectionTest, LooksAfterASlowOneInSmallSteps) {
  projector_->ready = in(600s);
  for (int steps = 0; steps < 3; ++steps) {
    EXPECT_LE(projection_->next_change(), steady_clock::now());
    projection_->supervise();
    EXPECT_EQ(projection_->status().state, DeviceState::kOpening);
  }
  projector_->ready = in(0s);
  projection_->supervise();
  EXPECT_EQ(projection_->status().state, DeviceState::kReady);
  projector_->ready = in(600s);
  projection_->supervise();
  EXPECT_LE(projection_->next_change(), steady_clock::now()) << "it has not answered yet";
  EXPECT_EQ(projection_->status().state, DeviceState::kReady);
}

TEST_F(SlowProjectionTest, EndsItsWaitWhenNobodyWaitsForTheOutcome) {
  projector_->ready = in(600s);
  std::stop_source stop;
  std::jthread hand([&stop] {
    std::this_thread::sleep_for(50ms);
    stop.request_stop();
  });
  EXPECT_EQ(projection_->show(Picture::kPattern, in(600s), stop.get_token()).error().code, ErrorCode::kCancelled);
}

TEST_F(ProjectionTest, EndsWhenTheServiceStops) {
  projection_->set_pattern(Grey8(1, 1));
  std::stop_source stop;
  stop.request_stop();
  const auto shown = projection_->show(Picture::kPattern, in(600s), stop.get_token());
  EXPECT_EQ(shown.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace slsd
