// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/configuration/presets.hpp"

#include <gtest/gtest.h>

#include <string>

namespace slsd {
namespace {

using nlohmann::json;

const json kInForce{{"decode", {{"depth_max_mm", 900.0}}}, {"calibration", {{"file", "new.yml"}}}};

json saved(const std::string& name) {
  return *with_preset(json::object(), name, kInForce, "2026-01-31T12:00:00Z");
}

TEST(WithPreset, LeavesTheCalibrationOut) {
  EXPECT_EQ(saved("part-a"), (json{{"part-a",
                                    {{"version", kPresetVersion},
                                     {"saved", "2026-01-31T12:00:00Z"},
                                     {"settings", {{"decode", {{"depth_max_mm", 900.0}}}}}}}}));
}

TEST(WithPreset, TakesPlainNamesAlone) {
  EXPECT_TRUE(check_preset_name("Part_7.b-2"));
  EXPECT_TRUE(check_preset_name(std::string(64, 'a')));
  for (const std::string& name :
       {std::string(), std::string(65, 'a'), std::string("a b"), std::string("../a"), std::string("-a"),
        std::string("_a"), std::string("a/b"), std::string("\xc3\xa9"), std::string("a\n"), std::string(1, '\0')})
    EXPECT_EQ(with_preset(json::object(), name, kInForce, "").error().code, ErrorCode::kInvalidArgument) << name;
}

TEST(WithPreset, HasALimitThatReplacingDoesNotMeet) {
  json presets = json::object();
  for (std::size_t i = 0; i < kPresetsMax; ++i) presets = *with_preset(presets, "p" + std::to_string(i), kInForce, "");
  EXPECT_EQ(with_preset(presets, "one-more", kInForce, "").error().code, ErrorCode::kNoSpace);
  EXPECT_TRUE(with_preset(presets, "p0", kInForce, ""));
}

TEST(SettingsOfPreset, KeepTheCalibrationInForce) {
  const json other{{"decode", {{"density", "pixels"}}}, {"calibration", {{"file", "newest.yml"}}}};
  EXPECT_EQ(*settings_of_preset(saved("a"), "a", other),
            (json{{"decode", {{"depth_max_mm", 900.0}}}, {"calibration", {{"file", "newest.yml"}}}}));
  EXPECT_EQ(*settings_of_preset(saved("a"), "a", json::object()), (json{{"decode", {{"depth_max_mm", 900.0}}}}));
}

TEST(SettingsOfPreset, NameTheNearestPreset) {
  const auto error = settings_of_preset(saved("part-a"), "prat-a", json::object()).error();
  EXPECT_EQ(error.code, ErrorCode::kNotFound);
  EXPECT_EQ(error.message, "there is no preset \"prat-a\"; did you mean part-a?");
  EXPECT_EQ(settings_of_preset(json::object(), "a", json::object()).error().message,
            "there is no preset \"a\": none is saved");
}

TEST(SettingsOfPreset, AreOfThisVersionAlone) {
  for (const json& version : {json(0), json(2), json("1"), json(), json(true)}) {
    json presets = saved("a");
    presets["a"]["version"] = version;
    const auto error = settings_of_preset(presets, "a", json::object()).error();
    EXPECT_EQ(error.code, ErrorCode::kMismatch) << version;
    EXPECT_NE(error.message.find("has version " + version.dump() + ", and this slsd reads version 1: save it again"),
              std::string::npos)
        << error.message;
  }
}

TEST(SettingsOfPreset, RefuseWhatCannotBeSet) {
  for (const json& settings :
       {json(), json::array(), json{{"server", {{"socket", "/x"}}}}, json{{"decode", 1}},
        json{{"calibration", {{"file", "old.yml"}}}}, json{{"camera", {{"a", {{"path", "/"}}}}}}}) {
    json presets = saved("a");
    presets["a"]["settings"] = settings;
    EXPECT_EQ(settings_of_preset(presets, "a", json::object()).error().code, ErrorCode::kInvalidArgument) << settings;
  }
  EXPECT_EQ(settings_of_preset(json{{"a", 5}}, "a", json::object()).error().code, ErrorCode::kMismatch);
}

}  // namespace
}  // namespace slsd
