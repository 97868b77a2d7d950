// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposition.hpp"

#include <gmock/gmock.h>

namespace slsd {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

TEST(Exposition, WritesFamiliesOfOpenMetrics) {
  Exposition out(MetricsFormat::kOpenMetrics);
  out.one("slsd_sent_bytes", "counter", "Bytes sent.", 12, "bytes");
  out.family("slsd_camera_state", "gauge", "State.");
  out.sample(1, {{"camera", "left"}, {"state", "ready"}});
  EXPECT_EQ(std::move(out).finish(),
            "# HELP slsd_sent_bytes Bytes sent.\n"
            "# TYPE slsd_sent_bytes counter\n"
            "# UNIT slsd_sent_bytes bytes\n"
            "slsd_sent_bytes_total 12\n"
            "# HELP slsd_camera_state State.\n"
            "# TYPE slsd_camera_state gauge\n"
            "slsd_camera_state{camera=\"left\",state=\"ready\"} 1\n"
            "# EOF\n");
}

TEST(Exposition, NamesCountersWithTotalInTheOlderFormat) {
  Exposition out(MetricsFormat::kPrometheus);
  out.one("slsd_sent_bytes", "counter", "Bytes sent.", 12, "bytes");
  EXPECT_EQ(std::move(out).finish(),
            "# HELP slsd_sent_bytes_total Bytes sent.\n"
            "# TYPE slsd_sent_bytes_total counter\n"
            "slsd_sent_bytes_total 12\n");
}

TEST(Exposition, EscapesLabels) {
  Exposition out(MetricsFormat::kOpenMetrics);
  out.family("slsd_requests", "counter", "Requests.");
  out.sample(1, {{"method", "a\"b\\c\nd"}});
  EXPECT_THAT(std::move(out).finish(), HasSubstr(R"(slsd_requests_total{method="a\"b\\c\nd"} 1)"));
}

TEST(Exposition, AddsUpTheBucketsOfAHistogram) {
  Duration duration;
  for (const std::chrono::milliseconds time : {1ms, 900ms, 60000ms}) duration.add(time);
  Exposition out(MetricsFormat::kOpenMetrics);
  out.family("slsd_stage_seconds", "histogram", "Time.", "seconds");
  out.histogram(duration, "stage", "classify");
  const std::string text = std::move(out).finish();
  EXPECT_THAT(text, HasSubstr("slsd_stage_seconds_bucket{stage=\"classify\",le=\"0.0005\"} 0\n"));
  EXPECT_THAT(text, HasSubstr("slsd_stage_seconds_bucket{stage=\"classify\",le=\"1.0\"} 2\n"));
  EXPECT_THAT(text, HasSubstr("slsd_stage_seconds_bucket{stage=\"classify\",le=\"+Inf\"} 3\n"));
  EXPECT_THAT(text, HasSubstr("slsd_stage_seconds_count{stage=\"classify\"} 3\n"));
  EXPECT_THAT(text, HasSubstr("slsd_stage_seconds_sum{stage=\"classify\"} 60.901\n"));
}

}  // namespace
}  // namespace slsd
