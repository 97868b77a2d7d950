// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// What is said of a configuration that is wrong, and of which place in it.
#include <string>

#include <gmock/gmock.h>

#include "tests/daemon/configuration/read_text.hpp"

namespace slsd {
namespace {

using test::error_of;
using test::read;
using ::testing::HasSubstr;

TEST(ReadConfiguration, NamesThePlaceAndTheRemedy) {
  EXPECT_EQ(error_of("[pattern]\nsymbol_size = 8\n"),
            "etc/slsd.toml:2:1: no such key in [pattern]: symbol_size; did you mean symbol_size_px?");
  EXPECT_EQ(error_of("[patern]\n"), "etc/slsd.toml:1:2: no such table or key: patern; did you mean pattern?");
  EXPECT_EQ(error_of("[pattern]\nseed = \"x\"\n"),
            "etc/slsd.toml:2:8: [pattern] seed must be a whole number from 0 to 4294967295");
  EXPECT_EQ(error_of("[server]\n\nclients_max = 0\n"),
            "etc/slsd.toml:3:15: [server] clients_max must be 1 to 10000, not 0");
  EXPECT_EQ(error_of("[projector]\ndriver = \"beamer\"\n"),
            "etc/slsd.toml:2:10: [projector] driver must be one of headless, glfw");
  EXPECT_THAT(error_of("[frame]\noutput = \"robot_base\"\n"),
              HasSubstr("needs hand_eye, the file that slsctl hand-eye"));
  EXPECT_EQ(error_of("[[camera]]\npath = \"a\"\n[[camera]]\npath = \"b\"\nname = \"camera\"\n"),
            "etc/slsd.toml:5:8: [[camera]] name \"camera\" is used twice: give each camera its own name");
}

TEST(ReadConfiguration, PlacesRangesAtTheKey) {
  EXPECT_THAT(error_of("[pattern]\nspacing_px = 2\nsymbol_size_px = 9\n"), HasSubstr("slsd.toml:3:18: "));
  EXPECT_THAT(error_of("[pattern]\nsymbols = [7, 7]\n"), HasSubstr("slsd.toml:2:11: "));
  EXPECT_THAT(error_of("[projector]\nwidth_px = 100\n"), HasSubstr("slsd.toml:2:12: "));
  EXPECT_THAT(error_of("[projector]\nrefresh_hz = 5.0\n"), HasSubstr("slsd.toml:2:14: "));
  EXPECT_THAT(error_of("[scan]\nprojector_latency_ms = 1001\n"), HasSubstr("slsd.toml:2:24: "));
  EXPECT_THAT(error_of("[scan]\npower_line_hz = 55\n"), HasSubstr("slsd.toml:2:17: "));
  EXPECT_THAT(error_of("[decode]\ndepth_min_mm = 900.0\ndepth_max_mm = 800.0\n"), HasSubstr("slsd.toml:"));
  EXPECT_THAT(error_of("[[camera]]\npath = \"x\"\nrate_hz = -1\n"), HasSubstr("slsd.toml:3:11: "));
  EXPECT_THAT(error_of("[[camera]]\npath = \"x\"\nfaults = [\"explode@1\"]\n"), HasSubstr("slsd.toml:3:10: "));
  EXPECT_THAT(error_of("[[camera]]\n"), HasSubstr("path must name"));
  const std::string aravis = "[[camera]]\ndriver = \"aravis\"\nid = \"1\"\n";
  EXPECT_THAT(error_of(aravis + "pixel_format = \"Mono14p\"\n"), HasSubstr("slsd.toml:4:16: "));
  EXPECT_THAT(error_of(aravis + "exposure_us = 0.5\n"), HasSubstr("slsd.toml:4:15: "));
  EXPECT_THAT(error_of(aravis + "trigger = \"hand\"\n"), HasSubstr("software, line, free_run, action"));
  EXPECT_THAT(error_of(aravis + "path = \"x\"\n"), HasSubstr("path is a key of the driver \"file\""));
  const std::string v4l2 = "[[camera]]\ndriver = \"v4l2\"\ndevice = \"x\"\n";
  EXPECT_THAT(error_of(v4l2 + "exposure_us = 0.5\n"), HasSubstr("slsd.toml:4:15: "));
  EXPECT_THAT(error_of(v4l2 + "power_line_hz = 55\n"), HasSubstr("slsd.toml:4:17: "));
  EXPECT_THAT(error_of(v4l2 + "width_px = 640\n"), HasSubstr("needs height_px"));
}

TEST(ReadConfiguration, RefusesExposuresThatCannotBeMerged) {
  const std::string camera = "[[camera]]\ndriver = \"v4l2\"\ndevice = \"x\"\n";
  for (const auto* wrong : {"[]", "[2000]", "2000", "[2000, 4000, 8000]", "[8000, 2000]", "[2000, 2000]",
                            "[2000, 2900]", "[10, 1001]", "[0.5, 100]", "[200000, 2000000]", "[2000, -8000]", "[0, 0]"})
    EXPECT_THAT(error_of(camera + "exposures_us = " + wrong + "\n"),
                HasSubstr("slsd.toml:4:16: [[camera]] exposures_us "))
        << wrong;
  EXPECT_THAT(error_of(camera + "exposures_us = [\"a\", 5]\n"), HasSubstr("must be a number or a list of numbers"));
  EXPECT_THAT(error_of(camera + "exposures_us = [2000, 8000]\nexposure_us = 2000\n"), HasSubstr("leave one out"));
  EXPECT_THAT(error_of(camera + "exposures_us = [2000, 8000]\nautomatic = true\n"),
              HasSubstr("exposures_us cannot be set while automatic is true"));
  EXPECT_THAT(error_of(camera + "exposures_us = [2000, 8000]\nframes_held_max = 5\n"),
              HasSubstr("exposures_us needs frames_held_max of 6 or more"));
}

TEST(ReadConfiguration, RefusesAReachOfRunsThatTheMethodDoesNotPromise) {
  EXPECT_THAT(error_of("[pattern]\nmethod = \"constructive\"\nrow_reach = 40\n"),
              HasSubstr("row_reach and column_reach need method = \"no_repeats\""));
  EXPECT_THAT(error_of("[pattern]\nmethod = \"no_repeats\"\nrow_reach = 600\n"), HasSubstr("0 to 512"));
  EXPECT_THAT(error_of("[pattern]\nfile = \"p.toml\"\ncolumn_reach = 3\n"), HasSubstr("cannot be combined with file"));
}

TEST(ReadConfiguration, RefusesWrongTypes) {
  for (const char* text : {"pattern = 3",
                           "camera = 3",
                           "[camera]",
                           "camera = [3]",
                           "[pattern]\nsymbols = 5",
                           "[pattern]\nsymbols = [\"5\"]",
                           "[pattern]\nsymbols = [99999999999]",
                           "[pattern]\nhalf_turn_unique = 1",
                           "[pattern]\nseed = 1.0",
                           "[pattern]\nseed = -1",
                           "[decode]\ndepth_min_mm = nan",
                           "[decode]\ndepth_min_mm = inf",
                           "[decode]\ndepth_min_mm = \"1\"",
                           "[decode]\nwrong_cells_max = 0.0",
                           "[decode]\nwrong_cells_max = 1.5",
                           "[server]\nsocket = 1",
                           "[server]\nsocket = \"\\u0000\"",
                           "[calibration]\nfile = []",
                           "[[camera]]\npath = \"x\"\nfaults = [1]",
                           "[[camera]]\npath = \"x\"\nwidth_px = 5"}) {
    EXPECT_THAT(error_of(text), HasSubstr("slsd.toml:")) << text;
  }
}

TEST(ReadConfiguration, RefusesNumbersThatNoIntHolds) {
  for (const char* number : {"-9223372036854775808", "9223372036854775807", "-2147483649", "2147483648"}) {
    EXPECT_THAT(error_of("[pattern]\nsymbols = [" + std::string(number) + "]\n"), HasSubstr("a list of whole numbers"));
  }
}

TEST(ReadConfiguration, RefusesWhatIsNoToml) {
  for (const std::string text : {"[pattern", "a = ", "\xff\xfe", "[a]\n[a]\n", "a = \"\n"}) {
    const auto configuration = read(text);
    ASSERT_FALSE(configuration);
    EXPECT_EQ(configuration.error().code, ErrorCode::kMalformed);
    EXPECT_THAT(configuration.error().where, HasSubstr("etc/slsd.toml:"));
  }
  EXPECT_FALSE(read("a = " + std::string(100000, '[')));
}

TEST(LoadConfiguration, NamesAFileThatIsMissing) {
  const auto configuration = load_configuration("/nowhere/slsd.toml");
  ASSERT_FALSE(configuration);
  EXPECT_EQ(configuration.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(to_string(configuration.error()), HasSubstr("/nowhere/slsd.toml"));
}

}  // namespace
}  // namespace slsd
