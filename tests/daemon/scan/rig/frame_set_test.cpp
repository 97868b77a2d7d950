// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cstdlib>
#include <iostream>
#include <map>
#include <random>

#include <gmock/gmock.h>

#include "daemon/scan/rig/devices.hpp"
#include "daemon/scan/rig/rig.hpp"
#include "tests/daemon/scan/clocked_camera.hpp"
#include "tests/doubles/gige/gige_camera.hpp"
#include "tests/drivers/camera/aravis/gige_backend.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

constexpr int kSets = 300;
constexpr int kDropEvery = 50;

int sets_wanted() {
  const char* wanted = std::getenv("SLSD_TEST_SETS");
  return wanted != nullptr ? std::atoi(wanted) : kSets;
}

std::unique_ptr<Rig> rig_on(std::vector<std::unique_ptr<Camera>> cameras, int exposure_skew_ms) {
  const ScanOptions options{
      .timeout_ms = 5000, .exposure_skew_ms = exposure_skew_ms, .reopen_first_ms = 1, .reopen_longest_ms = 5};
  return std::make_unique<Rig>(std::move(*make_projector({})), std::move(cameras), Grey8(1280, 800), options);
}

/// Two cameras of GigE Vision on loopback, triggered by software, whose frames say which exposure they are.
class TriggeredPair : public ::testing::Test {
 protected:
  void SetUp() override {
    std::vector<std::unique_ptr<Camera>> cameras;
    for (test::GigeCamera* device : {&left_, &right_}) {
      AravisCameraOptions options = test::options_for(*device);
      options.name = device == &left_ ? "left" : "right";
      options.frame_timeout_ms = 300;
      options.missed_frames_max = 100;
      cameras.push_back(std::make_unique<AravisCamera>(options));
    }
    rig_ = rig_on(std::move(cameras), 10000);
  }

  /// By how much the exposures' numbers differ, if the pixels are whole.
  static std::optional<std::int64_t> lead(const FrameSet& set) {
    const auto left = test::counter_of(set.frames.at(0).image());
    const auto right = test::counter_of(set.frames.at(1).image());
    if (!left || !right) return std::nullopt;
    return static_cast<std::int64_t>(*left) - static_cast<std::int64_t>(*right);
  }

  std::uint64_t times_opened() const {
    std::uint64_t times = 0;
    for (const DeviceStatus& status : rig_->camera_statuses()) times += status.opened;
    return times;
  }

  test::GigeCamera left_{{.serial = "LEFT"}};
  test::GigeCamera right_{{.serial = "RIGHT"}};
  std::unique_ptr<Rig> rig_;
};

TEST_F(TriggeredPair, NoSetIsMixedOfTwoExposures) {
  const int sets = sets_wanted();
  std::minstd_rand random(11);
  std::optional<std::int64_t> first_lead;  // one warms up with more frames than the other
  std::uint64_t opened = 0;
  int whole = 0;
  int mixed = 0;
  int refused = 0;
  std::map<std::string, int> reasons;
  std::chrono::nanoseconds worst_skew{};
  while (whole < sets && refused < sets) {
    if (random() % kDropEvery == 0) (random() % 2 == 0 ? left_ : right_).set_faults({.drop_frames = 1});
    const auto set = rig_->capture(steady_clock::now() + 20s);
    if (!set) {
      ++refused;
      ++reasons[to_string(set.error())];
      continue;
    }
    const std::uint64_t opened_now = times_opened();
    if (opened != opened_now) first_lead = lead(*set);
    opened = opened_now;
    ++whole;
    mixed += lead(*set) == first_lead ? 0 : 1;
    worst_skew = std::max(worst_skew, set->skew);
  }
  std::cout << whole << " sets, " << mixed << " mixed, " << refused << " refused, worst skew "
            << std::chrono::duration<double, std::milli>(worst_skew).count() << " ms\n";
  for (const auto& [reason, times] : reasons) std::cout << "  " << times << " refused: " << reason << "\n";
  EXPECT_EQ(whole, sets);
  EXPECT_EQ(mixed, 0);
  EXPECT_GT(refused, 0);
}

TEST_F(TriggeredPair, IncompleteSetNamesTheCamera) {
  ASSERT_TRUE(rig_->capture(steady_clock::now() + 20s));
  right_.set_faults({.drop_frames = 1});
  const auto set = rig_->capture(steady_clock::now() + 20s);
  ASSERT_FALSE(set);
  EXPECT_EQ(set.error().code, ErrorCode::kFrameDropped);
  EXPECT_EQ(set.error().where, "camera right");
  EXPECT_THAT(set.error().message, ::testing::HasSubstr("the set of 2 frames is incomplete"));
}

class FreePair : public ::testing::Test {
 protected:
  std::unique_ptr<Rig> pair(std::chrono::nanoseconds phase, int exposure_skew_ms) {
    const MonotonicTime start = steady_clock::now();
    std::vector<std::unique_ptr<Camera>> cameras;
    cameras.push_back(std::make_unique<ClockedCamera>("left", image_, start, kPeriod));
    cameras.push_back(std::make_unique<ClockedCamera>("right", image_, start + phase, kPeriod));
    return rig_on(std::move(cameras), exposure_skew_ms);
  }

  static constexpr std::chrono::nanoseconds kPeriod = 20ms;
  Grey8 image_{16, 16};
};

TEST_F(FreePair, TakesTheFramesThatAreNearestInTime) {
  for (const auto phase : {0ms, 1ms, 6ms, 9ms, 11ms, 14ms, 19ms}) {
    const auto rig = pair(phase, 10000);
    for (int i = 0; i < 10; ++i) {
      const auto set = rig->capture(steady_clock::now() + 20s, i < 5 ? Exposure::kFresh : Exposure::kNext);
      ASSERT_TRUE(set) << to_string(set.error());
      EXPECT_EQ(set->skew, std::min<std::chrono::nanoseconds>(phase, kPeriod - phase)) << phase.count();
    }
  }
}

TEST_F(FreePair, RefusesWhatIsApartAndSaysByHowMuch) {
  const auto rig = pair(8ms, 5);
  const auto set = rig->capture(steady_clock::now() + 20s);
  ASSERT_FALSE(set);
  EXPECT_EQ(set.error().code, ErrorCode::kFrameSkewed);
  EXPECT_THAT(set.error().message, ::testing::HasSubstr("8.000 ms after"));
}

TEST_F(FreePair, GoesOnWithoutLosingAFrame) {
  const auto rig = pair(3ms, 10000);
  auto set = rig->capture(steady_clock::now() + 20s);
  ASSERT_TRUE(set);
  for (int i = 0; i < 20; ++i) {
    const std::uint64_t before = set->frames[0].sequence();
    std::this_thread::sleep_for(i % 5 * 10ms);
    set = rig->capture(steady_clock::now() + 20s, Exposure::kNext);
    ASSERT_TRUE(set);
    EXPECT_EQ(set->frames[0].sequence(), before + 1);
    EXPECT_EQ(set->skew, 3ms);
  }
}

}  // namespace
}  // namespace slsd
