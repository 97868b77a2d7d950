// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/x11/choose_output.hpp"

#include <functional>

#include <gmock/gmock.h>

namespace slsd {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

RandrOutput output(unsigned long id, const std::string& name, int x_px, bool primary = false) {
  RandrOutput output;
  output.id = id;
  output.name = name;
  output.serial = "S" + name;
  output.primary = primary;
  output.area = {x_px, 0, 1280, 800};
  output.mode_width_px = output.native_width_px = 1280;
  output.mode_height_px = output.native_height_px = 800;
  output.refresh_hz = 60;
  output.rgb_range = "Full";
  return output;
}

const std::vector<RandrOutput> kDesk{output(1, "DP-1", 0, true), output(2, "HDMI-1", 1280)};

std::string chosen(const std::vector<RandrOutput>& outputs, const std::string& wanted, const std::string& last = {}) {
  const auto found = choose_output(outputs, wanted, last);
  return found ? found->name : to_string(found.error());
}

TEST(ChooseOutput, TakesNameSerialOrPlace) {
  for (const char* wanted : {"HDMI-1", "SHDMI-1", "+1280+0"}) EXPECT_EQ(chosen(kDesk, wanted), "HDMI-1");
  EXPECT_EQ(chosen(kDesk, "DP-1"), "DP-1");
}

TEST(ChooseOutput, TakesTheOneThatIsNotPrimary) {
  EXPECT_EQ(chosen(kDesk, ""), "HDMI-1");
  EXPECT_EQ(chosen({output(1, "A", 0), output(2, "B", 1280, true)}, ""), "A");
  EXPECT_EQ(chosen({output(1, "A", 0), output(2, "B", 1280)}, ""), "B") << "without a primary the first counts as that";
  EXPECT_EQ(chosen({output(1, "A", 0, true)}, ""), "A");
}

TEST(ChooseOutput, StaysWithTheMonitorThatItHad) {
  EXPECT_THAT(chosen({kDesk[0]}, "", "HDMI-1"), HasSubstr("\"HDMI-1\" is not plugged in"));
  EXPECT_EQ(chosen(kDesk, "", "DP-1"), "DP-1");
  EXPECT_EQ(chosen(kDesk, "HDMI-1", "DP-1"), "HDMI-1");
}

TEST(ChooseOutput, AsksWhereSeveralAreMeant) {
  auto desk = kDesk;
  desk.push_back(output(3, "HDMI-2", 2560));
  const auto found = choose_output(desk, "", "");
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(found.error().message, HasSubstr("HDMI-2, serial SHDMI-2, 1280x800 at 60.00 Hz, +2560+0"));
  EXPECT_THAT(chosen({}, ""), HasSubstr("no monitor is plugged in"));
}

TEST(CheckFit, WantsTheSizePixelForPixel) {
  EXPECT_TRUE(check_fit(kDesk[1], 1280, 800));
  EXPECT_THAT(check_fit(kDesk[1], 1920, 1080).error().message, HasSubstr("--mode 1920x1080"));
  RandrOutput scaled = kDesk[1];
  scaled.transformed = true;
  EXPECT_THAT(check_fit(scaled, 1280, 800).error().message, HasSubstr("--scale 1x1"));
  RandrOutput turned = kDesk[1];
  turned.rotation_deg = 90;
  turned.area = {0, 0, 800, 1280};
  EXPECT_THAT(check_fit(turned, 1280, 800).error().message, HasSubstr("--rotate normal"));
}

TEST(CheckFit, NamesWhatEndsPanning) {
  RandrOutput panning = kDesk[1];
  panning.mode_width_px = 1280, panning.mode_height_px = 800;
  panning.area.width_px = 1920, panning.area.height_px = 1080;
  for (const auto& [width_px, height_px] : {std::pair{1280, 800}, std::pair{1920, 1080}}) {
    EXPECT_THAT(check_fit(panning, width_px, height_px).error().message,
                HasSubstr("it pans over 1920x1080 pixels with a mode of 1280x800: run xrandr --output " + panning.name +
                          " --panning 0x0"));
  }
  RandrOutput turned = panning;
  turned.rotation_deg = 90;
  turned.area.width_px = 800, turned.area.height_px = 1280;
  EXPECT_THAT(check_fit(turned, 1280, 800).error().message, HasSubstr("--rotate normal"));
}

TEST(OutputWarnings, SaysNothingOfAGoodMonitor) {
  EXPECT_THAT(output_warnings(kDesk[1], kDesk), IsEmpty());
}

TEST(OutputWarnings, NamesEachDisturbanceAndItsRemedy) {
  const auto warning = [](const std::function<void(RandrOutput&)>& disturb) {
    RandrOutput disturbed = kDesk[1];
    disturb(disturbed);
    return output_warnings(disturbed, std::vector{kDesk[0], disturbed});
  };
  EXPECT_THAT(warning([](auto& o) { o.native_width_px = 1920; }), ElementsAre(HasSubstr("1920x800")));
  EXPECT_THAT(warning([](auto& o) { o.area.x_px = 1279; }), ElementsAre(HasSubstr("--right-of DP-1")));
  EXPECT_THAT(warning([](auto& o) { o.rotation_deg = 180; }), ElementsAre(HasSubstr("--rotate normal")));
  EXPECT_THAT(warning([](auto& o) { o.reflected = true; }), ElementsAre(HasSubstr("--reflect normal")));
  EXPECT_THAT(warning([](auto& o) { o.gamma_active = true; }), ElementsAre(HasSubstr("--gamma 1:1:1")));
  EXPECT_THAT(warning([](auto& o) { o.rgb_range = "Limited 16:235"; }), ElementsAre(HasSubstr("Limited 16:235")));
  EXPECT_THAT(warning([](auto& o) { o.underscan = true; }), ElementsAre(HasSubstr("--set underscan off")));
  EXPECT_THAT(warning([](auto& o) { o.name = "XWAYLAND0"; }), ElementsAre(HasSubstr("Wayland")));
}

}  // namespace
}  // namespace slsd
