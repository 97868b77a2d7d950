// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/configuration/exposure_warnings.hpp"

#include <gmock/gmock.h>

namespace slsd {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

std::vector<std::string> warnings_for(const std::string& tables) {
  const auto configuration = read_configuration(tables, "slsd.toml");
  EXPECT_TRUE(configuration) << to_string(configuration.error());
  return configuration ? exposure_warnings(*configuration) : std::vector<std::string>();
}

std::string camera(const std::string& exposure) {
  return "[[camera]]\nname = \"left\"\ndriver = \"v4l2\"\ndevice = \"x\"\n" + exposure;
}

TEST(ExposureWarnings, NameCameraPeriodAndNearestExposures) {
  EXPECT_THAT(warnings_for(camera("exposure_us = 20000\n")),
              ElementsAre(AllOf(HasSubstr("camera \"left\": exposure_us = 20000"), HasSubstr("16667 us at 60 Hz"),
                                HasSubstr("set 16667 or 33333"), Not(HasSubstr("lamps")))));
}

TEST(ExposureWarnings, ThinkOfTheLampsWhereTheyAreKnown) {
  const std::string lamps = "[scan]\npower_line_hz = 50\n";
  EXPECT_THAT(warnings_for(lamps + camera("exposure_us = 16667\n")),
              ElementsAre(AllOf(HasSubstr("half a lamp period (10000 us at 50 Hz)"), HasSubstr("set 50000"),
                                Not(HasSubstr("a projector frame")))));
  EXPECT_THAT(warnings_for(lamps + camera("exposure_us = 12000\n")),
              ElementsAre(HasSubstr(", nor of half a lamp period")));
  EXPECT_THAT(warnings_for(lamps + camera("exposure_us = 50000\n")), IsEmpty());
  EXPECT_THAT(warnings_for(camera("exposures_us = [16700, 40000]\n")),
              ElementsAre(HasSubstr("of exposures_us, 40000 is not a whole multiple")));
}

TEST(ExposureWarnings, AreNoneWhereNothingIsWrong) {
  EXPECT_THAT(warnings_for(""), IsEmpty());
  EXPECT_THAT(warnings_for(camera("")), IsEmpty());
  EXPECT_THAT(warnings_for(camera("exposure_us = 16700\n")), IsEmpty());
  EXPECT_THAT(warnings_for("[projector]\nrefresh_hz = 0\n" + camera("exposure_us = 5000\n")), IsEmpty());
  EXPECT_THAT(warnings_for("[[camera]]\npath = \"x\"\n"), IsEmpty());
}

// A camera of Aravis has an exposure also where none is configured.
TEST(ExposureWarnings, KnowTheDefault) {
  EXPECT_THAT(warnings_for("[[camera]]\ndriver = \"aravis\"\nid = \"1\"\n"),
              ElementsAre(HasSubstr("exposure_us = 10000")));
}

}  // namespace
}  // namespace slsd
