// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/utc_text.hpp"

#include <cstdlib>
#include <ctime>

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

namespace slsd {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::system_clock;

system_clock::time_point at_ms(std::int64_t ms) {
  return system_clock::time_point(milliseconds(ms));
}

/// A time zone for as long as it lives.
class InZone {
 public:
  explicit InZone(const char* zone) {
    if (const char* had = std::getenv("TZ")) had_ = had;
    set(zone);
  }
  InZone(const InZone&) = delete;
  InZone& operator=(const InZone&) = delete;
  ~InZone() { set(had_ ? had_->c_str() : nullptr); }

 private:
  static void set(const char* zone) {
    if (zone != nullptr)
      ::setenv("TZ", zone, 1);
    else
      ::unsetenv("TZ");
    ::tzset();
  }

  std::optional<std::string> had_;
};

// As POSIX writes them, so that they do not depend on tzdata: UTC, Kathmandu, New York and Chatham. The last two save
// daylight, on opposite halves of the globe.
class UtcTextInZone : public ::testing::TestWithParam<const char*> {
 protected:
  InZone zone_{GetParam()};
};
INSTANTIATE_TEST_SUITE_P(Zones, UtcTextInZone,
                         ::testing::Values("UTC0", "<+0545>-5:45", "EST5EDT,M3.2.0,M11.1.0",
                                           "<+1245>-12:45<+1345>,M9.5.0/2:45,M4.1.0/3:45"));

TEST_P(UtcTextInZone, IsOfWholeSeconds) {
  EXPECT_EQ(utc_text(at_ms(1769860800999)), "2026-01-31T12:00:00Z");
  EXPECT_EQ(utc_text(at_ms(1785499200000)), "2026-07-31T12:00:00Z");
}

TEST_P(UtcTextInZone, HasMillisecondsWhereAskedFor) {
  EXPECT_EQ(utc_text_ms(at_ms(1769860800000)), "2026-01-31T12:00:00.000Z");
  EXPECT_EQ(utc_text_ms(at_ms(1769860800007)), "2026-01-31T12:00:00.007Z");
}

TEST_P(UtcTextInZone, ReachesBeforeTheEpoch) {
  EXPECT_EQ(utc_text_ms(at_ms(-1)), "1969-12-31T23:59:59.999Z");
}

TEST_P(UtcTextInZone, IsReadAsItWasWritten) {
  EXPECT_EQ(time_from_utc("2026-01-31T12:00:00Z"), at_ms(1769860800000));
  EXPECT_EQ(time_from_utc("2026-07-31T12:00:00.250Z"), at_ms(1785499200250));
  EXPECT_EQ(time_from_utc("1969-12-31T23:59:59.999Z"), at_ms(-1));
}

// New York sets its clocks back from 02:00 to 01:00 at 06:00 UTC of 1 November 2026, and forward at 07:00 UTC of
// 8 March.
TEST_P(UtcTextInZone, GoesOnWhereClocksAreChanged) {
  for (const std::int64_t change_s : {1793512800, 1772953200}) {
    const auto before = time_from_utc(utc_text_ms(at_ms(change_s * 1000 - 1)));
    const auto after = time_from_utc(utc_text_ms(at_ms(change_s * 1000)));
    ASSERT_TRUE(before && after);
    EXPECT_EQ(*after - *before, milliseconds(1));
  }
}

TEST(UtcText, IsWhatTheCLibrarySays) {
  const InZone zone("<+0545>-5:45");
  rc::check([] {
    const auto seconds = *rc::gen::inRange<std::time_t>(-9'000'000'000, 9'000'000'000);
    std::tm parts{};
    ::gmtime_r(&seconds, &parts);
    char expected[32];
    std::strftime(expected, sizeof expected, "%Y-%m-%dT%H:%M:%SZ", &parts);
    RC_ASSERT(utc_text(system_clock::from_time_t(seconds)) == expected);
    RC_ASSERT(time_from_utc(expected) == system_clock::from_time_t(seconds));
  });
}

TEST(TimeFromUtc, TakesUpToNineDecimals) {
  EXPECT_EQ(time_from_utc("1970-01-01T00:00:00.5Z"), at_ms(500));
  EXPECT_EQ(time_from_utc("1970-01-01T00:00:01.000000007Z"), system_clock::time_point(nanoseconds(1'000'000'007)));
}

TEST(TimeFromUtc, RefusesWhatIsNoTimeInUtc) {
  for (const char* text : {"",
                           "Z",
                           "2026-01-31",
                           "2026-01-31T12:00:00",
                           "2026-01-31T12:00:00+01:00",
                           "2026-01-31 12:00:00Z",
                           "2026-01-31T12:00Z",
                           "2026-1-31T12:00:00Z",
                           "2026-02-29T12:00:00Z",
                           "2026-13-01T12:00:00Z",
                           "2026-00-01T12:00:00Z",
                           "2026-01-00T12:00:00Z",
                           "2026-01-31T24:00:00Z",
                           "2026-01-31T12:60:00Z",
                           "2026-01-31T12:00:60Z",
                           "2026-01-31T12:00:00.Z",
                           "2026-01-31T12:00:00.1234567890Z",
                           "2026-01-31T12:00:00.-1Z",
                           "2026-01-31T12:00:00,5Z",
                           "9999-01-31T12:00:00Z",
                           "0001-01-31T12:00:00Z",
                           "2026-01-31T12:00:00ZZ",
                           "+026-01-31T12:00:00Z",
                           "2026-01-31T12:00:00.5"})
    EXPECT_EQ(time_from_utc(text), std::nullopt) << text;
}

}  // namespace
}  // namespace slsd
