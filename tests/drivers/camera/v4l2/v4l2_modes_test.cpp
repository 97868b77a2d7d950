// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// What the camera asks of its device: format, size, rate and controls.
#include <gmock/gmock.h>

#include "tests/doubles/v4l2/numbered_frame.hpp"
#include "tests/drivers/camera/v4l2/v4l2_backends.hpp"

namespace slsd {
namespace {

using test::DoubleOptions;
using ::testing::HasSubstr;

class V4l2Format : public test::V4l2Test, public ::testing::WithParamInterface<std::uint32_t> {};

TEST_P(V4l2Format, GivesEachFrameWhole) {
  for (const int padding : {0, 32}) {
    DoubleOptions options = test::quick_double();
    options.formats = {{GetParam(), {{160, 120}}}};
    options.padding_bytes = padding;
    if (!make(options)) return;
    const auto opened = camera_->open();
    ASSERT_TRUE(opened) << to_string(opened.error());
    for (int i = 0; i < 5; ++i) {
      const std::uint64_t next = double_->next_number();
      const auto frame = capture();
      ASSERT_TRUE(frame) << to_string(frame.error());
      const auto number = test::number_of(frame->image());
      ASSERT_TRUE(number);
      EXPECT_GE(*number, next);
    }
    camera_.reset();
  }
}

INSTANTIATE_TEST_SUITE_P(All, V4l2Format,
                         ::testing::Values(V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_Y10, V4L2_PIX_FMT_Y12, V4L2_PIX_FMT_Y16,
                                           V4L2_PIX_FMT_SBGGR8, V4L2_PIX_FMT_SRGGB10, V4L2_PIX_FMT_SRGGB16,
                                           V4L2_PIX_FMT_NV12, V4L2_PIX_FMT_YUV420, V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_UYVY,
                                           V4L2_PIX_FMT_MJPEG),
                         [](const auto& instance) { return fourcc_name(instance.param); });

FrameMode mode(const char* format, int width, int height) {
  return {*find_pixel_format(fourcc_from(format)), width, height};
}

const std::vector<FrameMode> kModes{mode("MJPG", 1920, 1080), mode("YUYV", 1280, 960), mode("GREY", 640, 480),
                                    mode("GREY", 1600, 1200), mode("GREY", 1280, 960)};

TEST(ChooseMode, TakesGreyAndOfThatTheLargest) {
  EXPECT_EQ(*choose_mode(kModes, {}), mode("GREY", 1600, 1200));
  EXPECT_EQ(*choose_mode({kModes[0], kModes[1]}, {}), mode("YUYV", 1280, 960));
  EXPECT_EQ(*choose_mode({mode("YUYV", 1280, 960), mode("RGGB", 640, 480)}, {}), mode("RGGB", 640, 480));
  EXPECT_EQ(*choose_mode({mode("Y16", 1280, 960), mode("GREY", 640, 480)}, {}), mode("GREY", 640, 480));
}

TEST(ChooseMode, TakesWhatIsAskedFor) {
  EXPECT_EQ(*choose_mode(kModes, {.size_px = {{1280, 960}}}), mode("GREY", 1280, 960));
  EXPECT_EQ(*choose_mode(kModes, {.size_px = {{1920, 1080}}}), mode("MJPG", 1920, 1080));
  EXPECT_EQ(*choose_mode(kModes, {.format = "YUYV"}), mode("YUYV", 1280, 960));
}

TEST(ChooseMode, ListsWhatThereIsWhereItRefuses) {
  const auto chosen = choose_mode(kModes, {.format = "Y12"});
  ASSERT_FALSE(chosen);
  EXPECT_EQ(chosen.error().code, ErrorCode::kUnsupported);
  EXPECT_THAT(chosen.error().message, HasSubstr("MJPG 1920x1080, YUYV 1280x960, GREY 640x480"));
  EXPECT_FALSE(choose_mode({}, {}));
}

TEST(FourccName, IsTheInverseOfFourccFrom) {
  for (const PixelFormat& format : pixel_formats()) EXPECT_EQ(fourcc_from(fourcc_name(format.fourcc)), format.fourcc);
}

class V4l2Settings : public test::V4l2Test {
 protected:
  Error open_error(const DoubleOptions& options, const V4l2CameraOptions& camera) {
    if (!make(options, camera)) return {};
    const auto opened = camera_->open();
    EXPECT_FALSE(opened);
    return opened ? Error{} : opened.error();
  }
};

DoubleOptions uvc() {
  DoubleOptions options = test::quick_double();
  options.controls = test::uvc_controls();
  return options;
}

TEST_F(V4l2Settings, AreSetInPhysicalUnitsWithEverythingAutomaticOff) {
  if (!make(uvc(),
            {.frame_rate_hz = 250.0, .exposure_us = 16700.0, .gain_steps = 12, .focus_steps = 40, .power_line_hz = 50}))
    return;
  const auto opened = camera_->open();
  ASSERT_TRUE(opened) << to_string(opened.error());
  EXPECT_EQ(double_->control(V4L2_CID_EXPOSURE_AUTO), V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(double_->control(V4L2_CID_EXPOSURE_AUTO_PRIORITY), 0);
  EXPECT_EQ(double_->control(V4L2_CID_AUTO_WHITE_BALANCE), 0);
  EXPECT_EQ(double_->control(V4L2_CID_FOCUS_AUTO), 0);
  EXPECT_EQ(double_->control(V4L2_CID_EXPOSURE_ABSOLUTE), 167);
  EXPECT_EQ(double_->control(V4L2_CID_GAIN), 12);
  EXPECT_EQ(double_->control(V4L2_CID_FOCUS_ABSOLUTE), 40);
  EXPECT_EQ(double_->control(V4L2_CID_POWER_LINE_FREQUENCY), V4L2_CID_POWER_LINE_FREQUENCY_50HZ);
}

TEST_F(V4l2Settings, LeaveAutomaticOnWhereAskedTo) {
  if (!make(uvc(), {.automatic = true})) return;
  ASSERT_TRUE(camera_->open());
  EXPECT_EQ(double_->control(V4L2_CID_EXPOSURE_AUTO), V4L2_EXPOSURE_APERTURE_PRIORITY);
}

TEST_F(V4l2Settings, NameTheControlThatDidNotTakeItsValue) {
  DoubleOptions options = uvc();
  options.refused_controls = {V4L2_CID_GAIN};
  const Error error = open_error(options, {.gain_steps = 20});
  if (!double_) return;
  EXPECT_EQ(error.code, ErrorCode::kMismatch);
  EXPECT_THAT(error.message, HasSubstr("\"Gain\" was set to 20, but reads back 10"));
}

TEST_F(V4l2Settings, NameTheAutomaticThatStaysOn) {
  DoubleOptions options = uvc();
  options.refused_controls = {V4L2_CID_EXPOSURE_AUTO};
  const Error error = open_error(options, {});
  if (!double_) return;
  EXPECT_EQ(error.code, ErrorCode::kMismatch);
  EXPECT_THAT(error.message, HasSubstr("Auto Exposure"));
}

TEST_F(V4l2Settings, NameTheRange) {
  const Error error = open_error(uvc(), {.exposure_us = 600000.0});
  if (!double_) return;
  EXPECT_EQ(error.code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(error.message, HasSubstr("exposure_us: the control \"Exposure Time, Absolute\" takes 1 to 5000"));
}

TEST_F(V4l2Settings, NameTheKeyThatTheCameraLacks) {
  const Error error = open_error(test::quick_double(), {.gain_steps = 1});
  if (!double_) return;
  EXPECT_EQ(error.code, ErrorCode::kUnsupported);
  EXPECT_THAT(error.message, HasSubstr("gain_steps"));
}

/// A camera whose gain has a unit.
DoubleOptions with_sensitivity() {
  DoubleOptions options = uvc();
  options.controls.push_back({V4L2_CID_ISO_SENSITIVITY_AUTO, "ISO Sensitivity, Auto", 0, 1, 1, 1, V4L2_CTRL_TYPE_MENU});
  options.controls.push_back({V4L2_CID_ISO_SENSITIVITY,
                              "ISO Sensitivity",
                              0,
                              3,
                              1,
                              0,
                              V4L2_CTRL_TYPE_INTEGER_MENU,
                              {100'000, 200'000, 400'000, 800'000}});
  return options;
}

TEST_F(V4l2Settings, TakeAGainInDecibelsWhereTheDriverKnowsThem) {
  if (!make(with_sensitivity(), {.gain_db = 12.0})) return;
  const auto opened = camera_->open();
  ASSERT_TRUE(opened) << to_string(opened.error());
  EXPECT_EQ(double_->control(V4L2_CID_ISO_SENSITIVITY), 2);
  EXPECT_EQ(double_->control(V4L2_CID_ISO_SENSITIVITY_AUTO), V4L2_ISO_SENSITIVITY_MANUAL);
}

TEST_F(V4l2Settings, NameTheDecibelsThatThereAre) {
  const Error error = open_error(with_sensitivity(), {.gain_db = 9.0});
  if (!double_) return;
  EXPECT_EQ(error.code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(error.message, HasSubstr("has 0.0, 6.0, 12.0, 18.1 dB"));
}

TEST_F(V4l2Settings, RefuseDecibelsWhereTheGainHasNoUnit) {
  const Error error = open_error(uvc(), {.gain_db = 6.0});
  if (!double_) return;
  EXPECT_EQ(error.code, ErrorCode::kUnsupported);
  EXPECT_THAT(error.message,
              HasSubstr("how many dB a step of the control \"Gain\" is; set gain_steps instead, 0 to 96"));
}

TEST_F(V4l2Settings, NameTheRateThatItHasInstead) {
  const Error error = open_error(uvc(), {.frame_rate_hz = 300.0});
  if (!double_) return;
  EXPECT_EQ(error.code, ErrorCode::kMismatch);
  EXPECT_THAT(error.message, HasSubstr("asked for 300 Hz, the camera set 250 Hz"));
}

TEST_F(V4l2Settings, RefuseAFormatThatWasChangedInSilence) {
  DoubleOptions options = uvc();
  options.changes_format = true;
  const Error error = open_error(options, {});
  if (!double_) return;
  EXPECT_EQ(error.code, ErrorCode::kMismatch);
  EXPECT_THAT(error.message, HasSubstr("asked for GREY 160x120, the camera set GREY 160x112"));
}

TEST(V4l2CameraOptions, AreChecked) {
  EXPECT_TRUE((V4l2CameraOptions{.device = "x"}.validate()));
  for (const V4l2CameraOptions& options :
       {V4l2CameraOptions{}, V4l2CameraOptions{.name = "", .device = "x"},
        V4l2CameraOptions{.device = "x", .format = "GREYS"}, V4l2CameraOptions{.device = "x", .size_px = {{0, 5}}},
        V4l2CameraOptions{.device = "x", .frame_rate_hz = 0.0}, V4l2CameraOptions{.device = "x", .exposure_us = 0.0},
        V4l2CameraOptions{.device = "x", .gain_db = 61.0},
        V4l2CameraOptions{.device = "x", .gain_db = 6.0, .gain_steps = 1},
        V4l2CameraOptions{.device = "x", .power_line_hz = 55}, V4l2CameraOptions{.device = "x", .readout_us = -1.0},
        V4l2CameraOptions{.device = "x", .settle_frames = -1}, V4l2CameraOptions{.device = "x", .frames_held_max = 25},
        V4l2CameraOptions{.device = "x", .exposure_us = 5.0, .automatic = true}}) {
    const auto valid = options.validate();
    ASSERT_FALSE(valid);
    EXPECT_EQ(valid.error().code, ErrorCode::kInvalidArgument);
  }
}

TEST(V4l2CameraOpen, NamesAFileThatIsNoCamera) {
  V4l2Camera camera({.device = "/dev/null"});
  const auto opened = camera.open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::kUnsupported);
  EXPECT_EQ(V4l2Camera({.device = "no-such-camera"}).open().error().code, ErrorCode::kNotFound);
  EXPECT_EQ(V4l2Camera({.device = "no-such-camera"}).description().device, "/dev/v4l/by-id/no-such-camera");
}

}  // namespace
}  // namespace slsd
