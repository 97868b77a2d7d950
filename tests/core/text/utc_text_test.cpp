// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/utc_text.hpp"

#include <gmock/gmock.h>

namespace slsd {
namespace {

using std::chrono::milliseconds;
using std::chrono::system_clock;

TEST(UtcText, IsOfWholeSeconds) {
  EXPECT_EQ(utc_text(system_clock::time_point(milliseconds(1769860800999))), "2026-01-31T12:00:00Z");
}

TEST(UtcText, HasMillisecondsWhereAskedFor) {
  EXPECT_EQ(utc_text_ms(system_clock::time_point(milliseconds(1769860800000))), "2026-01-31T12:00:00.000Z");
  EXPECT_EQ(utc_text_ms(system_clock::time_point(milliseconds(1769860800007))), "2026-01-31T12:00:00.007Z");
}

TEST(UtcText, ReachesBeforeTheEpoch) {
  EXPECT_EQ(utc_text_ms(system_clock::time_point(milliseconds(-1))), "1969-12-31T23:59:59.999Z");
}

}  // namespace
}  // namespace slsd
