// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/device/device_clock.hpp"

#include <chrono>
#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;

constexpr MonotonicTime kHostStart{1'000'000s};

/// A device's clock that goes faster by some parts per million.
struct Crystal {
  double ppm = 0.0;
  nanoseconds start{0};

  [[nodiscard]] nanoseconds at(MonotonicTime host) const {
    const nanoseconds since = host - kHostStart;
    return start + since + nanoseconds(std::llround(static_cast<double>(since.count()) * ppm * 1e-6));
  }
  /// Read `latency` after the command went out, of a round trip that takes `round_trip`.
  [[nodiscard]] ClockReading read(MonotonicTime sent, nanoseconds latency, nanoseconds round_trip) const {
    return {at(sent + latency), sent, sent + round_trip};
  }
};

nanoseconds off(MonotonicTime a, MonotonicTime b) {
  return a > b ? a - b : b - a;
}

TEST(DeviceClock, IsReadyAfterAReading) {
  DeviceClock clock;
  EXPECT_FALSE(clock.ready());
  clock.observe(Crystal{}.read(kHostStart, 50us, 100us));
  EXPECT_TRUE(clock.ready());
  EXPECT_EQ(clock.host_time(Crystal{}.at(kHostStart + 1ms)), kHostStart + 1ms);
}

TEST(DeviceClock, TrustsTheShortestRoundTripMost) {
  const Crystal crystal;
  DeviceClock clock;
  clock.observe(crystal.read(kHostStart, 900us, 1000us));
  clock.observe(crystal.read(kHostStart + 2ms, 10us, 20us));
  clock.observe(crystal.read(kHostStart + 4ms, 100us, 1000us));
  const nanoseconds device = crystal.at(kHostStart + 5ms);
  EXPECT_LE(off(clock.host_time(device), kHostStart + 5ms), 1us);
  EXPECT_LT(clock.uncertainty(device), 20us);
}

TEST(DeviceClock, LearnsTheDrift) {
  const Crystal crystal{.ppm = 73.0, .start = 5s};
  DeviceClock clock;
  for (int i = 0; i < 20; ++i) clock.observe(crystal.read(kHostStart + i * 1s, 50us, 100us));
  EXPECT_NEAR(clock.drift_ppm(), 73.0, 1.0);
  const MonotonicTime later = kHostStart + 21s;
  EXPECT_LE(off(clock.host_time(crystal.at(later)), later), 10us);
}

/// A clock that is set by so much after it was read eight times at once and then once a second, and read once more.
struct SteppedClock {
  explicit SteppedClock(nanoseconds by, Crystal before = {.ppm = 30.0, .start = 5s}) : crystal(before) {
    for (int i = 0; i < 8; ++i) observe(kHostStart + i * 1ms);
    for (int i = 1; i < 20; ++i) observe(kHostStart + i * 1s);
    crystal.start += by;
    observe(kHostStart + 20s);
  }
  void observe(MonotonicTime sent) { clock.observe(crystal.read(sent, 50us, 100us)); }

  Crystal crystal;
  DeviceClock clock;
};

constexpr nanoseconds kToTai = 1'700'000'000s;

TEST(DeviceClock, GoesByTheReadingsAfterAStep) {
  for (const nanoseconds step : {nanoseconds(kToTai), nanoseconds(37s), nanoseconds(5ms), nanoseconds(-5ms),
                                 nanoseconds(-3s), nanoseconds(-24s)}) {
    SteppedClock stepped(step);
    const Crystal& crystal = stepped.crystal;
    for (int i = 20; i < 60; ++i) {
      if (i > 20) stepped.observe(kHostStart + i * 1s);
      const MonotonicTime later = kHostStart + i * 1s + 500ms;
      EXPECT_LE(off(stepped.clock.host_time(crystal.at(later)), later), 200us) << step.count() << " after " << i;
      EXPECT_LE(std::chrono::abs(stepped.clock.device_time(later) - crystal.at(later)), 200us) << step.count();
      EXPECT_LE(std::abs(stepped.clock.drift_ppm()), 100.0) << step.count();
      EXPECT_EQ(stepped.clock.steady_since(), kHostStart + 20s + 100us);
    }
  }
}

TEST(DeviceClock, KeepsItsReadingsWhereTheDeviceIsSlowToAnswer) {
  const Crystal crystal{.ppm = -60.0, .start = 5s};
  DeviceClock clock;
  for (int i = 0; i < 8; ++i) clock.observe(crystal.read(kHostStart + i * 1ms, 50us, 100us));
  for (int i = 1; i < 40; ++i) {
    const bool slow = i % 3 == 0;
    clock.observe(crystal.read(kHostStart + i * 1s, slow ? 90ms : 50us, slow ? 100ms : 100us));
  }
  EXPECT_EQ(clock.steady_since(), kHostStart + 100us);
}

// Such a frame would seem to be exposed at any time after its trigger.
TEST(DeviceClock, KnowsWhatWasShownBeforeItWasSetBack) {
  for (const nanoseconds step : {nanoseconds(-24s), nanoseconds(-10ms)}) {
    const SteppedClock stepped(step);
    const MonotonicTime received = kHostStart + 19s + 900ms;
    EXPECT_FALSE(stepped.clock.may_have_shown(stepped.crystal.at(received) - step, received));
    EXPECT_TRUE(stepped.clock.may_have_shown(stepped.crystal.at(received), received));
  }
}

/// What a clock is found to be by readings once a second, by what it shows each time.
std::string_view fault_of(const std::function<nanoseconds(int)>& shown, bool may_be_set = false) {
  DeviceClock clock(may_be_set);
  for (int i = 0; i < 5; ++i) clock.observe({shown(i), kHostStart + i * 1s, kHostStart + i * 1s + 100us});
  EXPECT_EQ(clock.ready(), clock.fault().empty());
  return clock.fault();
}

TEST(DeviceClock, FindsOutWhatCannotBeTrusted) {
  EXPECT_EQ(fault_of([](int i) { return i * 1s; }), "");
  EXPECT_EQ(fault_of([](int) { return 7s; }), "stands still");
  EXPECT_EQ(fault_of([](int i) { return i * 2s; }), "does not run at the rate that it states");
  EXPECT_EQ(fault_of([](int i) { return i * 1010ms; }), "does not run at the rate that it states");
  EXPECT_EQ(fault_of([](int i) { return 100s - i * 1s; }), "keeps jumping back");
  EXPECT_EQ(fault_of([](int i) { return i * 1s + (i > 1 ? 40s : 0s) - (i > 2 ? 90s : 0s); }), "");
  EXPECT_EQ(fault_of([](int) { return 7s; }, true), "");
}

TEST(DeviceClock, TakesAnyNumber) {
  DeviceClock clock;
  clock.observe({nanoseconds::min(), kHostStart, kHostStart + 100us});
  for (const nanoseconds shown : {nanoseconds::max(), nanoseconds(0), nanoseconds::min()}) {
    EXPECT_LE(off(clock.host_time(shown), kHostStart), 24h * 366 * 50);
    EXPECT_EQ(clock.may_have_shown(shown, kHostStart, kHostStart + 1s), shown == nanoseconds::min());
  }
}

RC_GTEST_PROP(DeviceClock, IsNeverFartherOffThanItSays, (std::uint32_t seed)) {
  std::mt19937 random(seed);
  const auto within = [&](int low, int high) { return std::uniform_int_distribution(low, high)(random); };
  const Crystal crystal{.ppm = within(-80, 80) * 1.0, .start = within(0, 1000) * 1ms};
  DeviceClock clock;
  MonotonicTime now = kHostStart;
  for (int i = 0; i < within(1, 60); ++i) {
    const nanoseconds round_trip(within(20'000, 2'000'000));
    clock.observe(crystal.read(now, nanoseconds(within(0, static_cast<int>(round_trip.count()))), round_trip));
    now += round_trip + nanoseconds(within(1, 1'000'000'000));
  }
  const nanoseconds device = crystal.at(now);
  // It is a deviation, not a bound.
  RC_ASSERT(off(clock.host_time(device), now) <= 3 * clock.uncertainty(device));
}

}  // namespace
}  // namespace slsd
