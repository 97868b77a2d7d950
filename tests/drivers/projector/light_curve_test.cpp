// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/light_curve.hpp"

#include <cmath>
#include <numeric>

#include <gmock/gmock.h>

#include "drivers/projector/headless_projector.hpp"
#include "tests/drivers/plain_images.hpp"
#include "tests/drivers/projector/soon.hpp"

namespace slsd {
namespace {

using test::soon;

using ::testing::HasSubstr;

TEST(LightCurve, IsTheIdentityByDefault) {
  EXPECT_TRUE(LightCurve({}).is_identity());
  EXPECT_FALSE(LightCurve({.black_level = 1}).is_identity());
  std::vector<double> straight(256);
  std::iota(straight.begin(), straight.end(), 3.0);
  EXPECT_TRUE(LightCurve({.gamma = straight}).is_identity());
}

TEST(LightCurve, DimsInProportion) {
  const LightCurve curve({.brightness = 0.4});
  for (int grey = 0; grey < 256; ++grey) EXPECT_EQ(curve(static_cast<std::uint8_t>(grey)), std::lround(0.4 * grey));
}

// What the projector makes of the value is the light that was meant, to half a step of its values.
TEST(LightCurve, UndoesTheProjectorsGamma) {
  const LightCurve curve({.brightness = 0.8, .gamma = {2.2}});
  for (int grey = 0; grey < 256; ++grey) {
    const double value = curve(static_cast<std::uint8_t>(grey));
    const double meant = 0.8 * grey / 255;
    EXPECT_GE(std::pow((value + 0.5) / 255, 2.2), meant);
    EXPECT_LE(std::pow(std::max(0.0, value - 0.5) / 255, 2.2), meant);
  }
}

TEST(LightCurve, UndoesAMeasuredResponse) {
  const LightCurve curve({.gamma = {10, 20, 110}});  // a tenth of the light up to the middle
  EXPECT_EQ(curve(0), 0);
  EXPECT_EQ(curve(255), 255);
  EXPECT_NEAR(curve(25), 127.5 * 25 / 25.5, 0.6);
  EXPECT_NEAR(curve(128), 127.5 + 127.5 * (128 - 25.5) / 229.5, 0.6);
}

TEST(LightCurve, LiftsBlack) {
  const LightCurve curve({.black_level = 16});
  EXPECT_EQ(curve(0), 16);
  EXPECT_EQ(curve(255), 255);
  for (int grey = 1; grey < 256; ++grey) {
    EXPECT_LE(curve(static_cast<std::uint8_t>(grey - 1)), curve(static_cast<std::uint8_t>(grey)));
  }
}

TEST(LightOptions, NamesTheKeyThatIsWrong) {
  const auto wrong = [](const LightOptions& options) {
    const auto valid = options.validate();
    return valid ? std::string("valid") : valid.error().message;
  };
  EXPECT_EQ(wrong({}), "valid");
  EXPECT_EQ(wrong({.brightness = 0, .gamma = {0, 0.5, 1}, .black_level = 254}), "valid");
  EXPECT_THAT(wrong({.brightness = 1.5}), HasSubstr("brightness"));
  EXPECT_THAT(wrong({.brightness = std::nan("")}), HasSubstr("brightness"));
  EXPECT_THAT(wrong({.black_level = 255}), HasSubstr("black_level"));
  for (const std::vector<double>& gamma :
       {std::vector<double>{}, {0.0}, {11.0}, {1, 1}, {0, 2, 1}, std::vector<double>(257, 1.0)}) {
    EXPECT_THAT(wrong({.gamma = gamma}), HasSubstr("gamma"));
  }
}

TEST(HeadlessProjector, SendsWhatTheCurveMakesOfAnImage) {
  const LightOptions light{.brightness = 0.9, .gamma = {1.8}, .black_level = 5};
  HeadlessProjector projector({.width_px = 64, .height_px = 48, .light = light, .refresh_hz = 1000});
  ASSERT_TRUE(projector.open(soon()));
  const Grey8 image = test::ramp8(64, 48);
  ASSERT_TRUE(projector.show(image, soon()));
  EXPECT_EQ(projector.read_back(), LightCurve(light).apply(image));
}

}  // namespace
}  // namespace slsd
