// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/glfw/glfw_projector.hpp"

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <random>
#include <thread>

#include <gmock/gmock.h>
#include <sys/resource.h>

#include "core/code/pattern.hpp"
#include "drivers/files/file.hpp"
#include "drivers/projector/headless_projector.hpp"
#include "tests/doubles/x11/desktop.hpp"
#include "tests/doubles/x11/x_server.hpp"
#include "tests/drivers/plain_images.hpp"
#include "tests/drivers/projector/soon.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using test::Desktop;
using test::ramp8;
using test::soon;
using test::XServer;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr auto kTimeout = 30s;

bool eventually(const std::function<bool()>& holds) {
  for (const auto end = steady_clock::now() + kTimeout; steady_clock::now() < end;) {
    if (holds()) return true;
    std::this_thread::sleep_for(5ms);
  }
  return false;
}

ColourImage as_seen(const Grey8& image) {
  ColourImage seen(image.width(), image.height());
  for (std::size_t i = 0; i < image.size(); ++i) seen.data()[i].fill(image.data()[i]);
  return seen;
}

std::string problem_of(const Result<>& result) {
  return result ? "none" : to_string(result.error());
}

double processor_seconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

/// One monitor of any size.
class OnXvfb : public ::testing::Test {
 protected:
  bool start(int width_px, int height_px) {
    server_ = XServer::start_virtual(width_px, height_px);
    return server_ != nullptr;
  }

  std::unique_ptr<XServer> server_;
};

// A macro, because a test can be skipped only from within its own body.
#define START_XVFB(width_px, height_px) \
  if (!start(width_px, height_px)) GTEST_SKIP() << "no Xvfb starts here (package xvfb)"

TEST_F(OnXvfb, ShowsEveryShippedPatternExactly) {
  START_XVFB(1280, 800);
  const Desktop desktop(server_->display());
  GlfwProjector projector({});
  ASSERT_EQ(problem_of(projector.open(soon())), "none");
  int patterns = 0;
  for (const auto& file : std::filesystem::directory_iterator(SLSD_SOURCE_DIR "/config/patterns")) {
    const auto text = read_file(file.path(), 1 << 20);
    ASSERT_TRUE(text);
    const auto pattern = read_pattern(*text, file.path().string());
    ASSERT_TRUE(pattern) << to_string(pattern.error());
    const Grey8 image = draw_pattern(*pattern);
    ASSERT_TRUE(projector.show(image, soon())) << file.path();
    EXPECT_EQ(desktop.screenshot(0, 0, 1280, 800), as_seen(image)) << file.path();
    ++patterns;
  }
  EXPECT_GE(patterns, 8);
}

TEST_F(OnXvfb, ShowsEverySizeAsTheHeadlessProjectorKeepsIt) {
  const std::pair<int, int> sizes[] = {{640, 360}, {854, 480}, {1920, 1200}, {3840, 2160}};
  for (const auto& [width, height] : sizes) {
    START_XVFB(width, height);
    PatternOptions options;
    options.projector_width_px = width;
    options.projector_height_px = height;
    HeadlessProjector headless({.width_px = width, .height_px = height});
    GlfwProjector projector({.width_px = width, .height_px = height});
    ASSERT_EQ(problem_of(headless.open(soon())), "none");
    ASSERT_EQ(problem_of(projector.open(soon())), "none");
    const Desktop desktop(server_->display());
    for (const Grey8& image : {draw_pattern(*make_pattern(options)), ramp8(width, height)}) {
      ASSERT_TRUE(headless.show(image, soon()) && projector.show(image, soon()));
      EXPECT_EQ(*headless.read_back(), image);
      EXPECT_EQ(desktop.screenshot(0, 0, width, height), as_seen(image)) << width;
    }
  }
}

TEST_F(OnXvfb, DimsAsTheHeadlessProjectorDoes) {
  START_XVFB(640, 360);
  HeadlessProjector headless({.width_px = 640, .height_px = 360, .light = {.brightness = 0.4}});
  GlfwProjector projector({.width_px = 640, .height_px = 360, .light = {.brightness = 0.4}});
  ASSERT_TRUE(headless.open(soon()) && projector.open(soon()));
  const Grey8 image = ramp8(640, 360);
  ASSERT_TRUE(headless.show(image, soon()) && projector.show(image, soon()));
  EXPECT_EQ(*projector.read_back(), *headless.read_back());
  EXPECT_EQ(headless.read_back()->at(100, 0), std::lround(0.4 * image.at(100, 0)));
}

TEST_F(OnXvfb, RefusesAMonitorOfAnotherSize) {
  START_XVFB(1024, 768);
  const auto opened = GlfwProjector({}).open(soon());
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::kMismatch);
  EXPECT_THAT(opened.error().message, AllOf(HasSubstr("1024x768"), HasSubstr("1280x800"), HasSubstr("xrandr")));
}

TEST_F(OnXvfb, DrawsAgainOnlyWhatWasDamaged) {
  START_XVFB(640, 360);
  Desktop desktop(server_->display());
  GlfwProjector projector({.width_px = 640, .height_px = 360});
  ASSERT_EQ(problem_of(projector.open(soon())), "none");
  const Grey8 image = ramp8(640, 360);
  ASSERT_TRUE(projector.show(image, soon()));
  const double before = processor_seconds();
  std::this_thread::sleep_for(500ms);
  EXPECT_LT(processor_seconds() - before, 0.05);
  desktop.cover(10, 10, 300, 200);
  ASSERT_TRUE(eventually([&] { return desktop.screenshot(0, 0, 640, 360) != as_seen(image); }));
  desktop.uncover();
  EXPECT_TRUE(eventually([&] { return desktop.screenshot(0, 0, 640, 360) == as_seen(image); }));
}

TEST_F(OnXvfb, TellsRefreshesThatFollowOneAnother) {
  START_XVFB(640, 360);
  GlfwProjector projector({.width_px = 640, .height_px = 360});
  ASSERT_EQ(problem_of(projector.open(soon())), "none");
  const MonotonicTime first = *projector.show(Grey8(640, 360, 1), soon());
  MonotonicTime last = first;
  for (int i = 0; i < 30; ++i) {
    const MonotonicTime next = *projector.show(Grey8(640, 360), soon());
    EXPECT_GT(next, last);
    last = next;
  }
  EXPECT_GE(last - first, 300ms);  // Xvfb plays 60 refreshes a second, and may tell the first of them late
}

TEST_F(OnXvfb, OutlivesTheServerAndReturnsWithIt) {
  START_XVFB(640, 360);
  GlfwProjector projector({.width_px = 640, .height_px = 360});
  ASSERT_EQ(problem_of(projector.open(soon())), "none");
  for (int i = 0; i < 3; ++i) {
    server_->kill();
    EXPECT_TRUE(eventually([&] { return !projector.check(soon()); }));
    EXPECT_EQ(projector.show(Grey8(640, 360), soon()).error().code, ErrorCode::kDisconnected);
    EXPECT_EQ(projector.open(soon()).error().code, ErrorCode::kNotFound);
    ASSERT_TRUE(server_->restart());
    ASSERT_EQ(problem_of(projector.open(soon())), "none");
    const Grey8 image = ramp8(640, 360, i);
    ASSERT_TRUE(projector.show(image, soon()));
    EXPECT_EQ(Desktop(server_->display()).screenshot(0, 0, 640, 360), as_seen(image));
  }
}

TEST_F(OnXvfb, KeepsItsNumberWhileOthersStart) {
  START_XVFB(640, 360);
  const std::string display = server_->display();
  server_->kill();
  const auto other = XServer::start_virtual(640, 360);
  ASSERT_TRUE(other && server_->restart());
  EXPECT_EQ(server_->display(), display);
  EXPECT_NE(other->display(), display);
}

MonotonicTime in(std::chrono::nanoseconds time) {
  return steady_clock::now() + time;
}

TEST_F(OnXvfb, SaysWhenTheServerHangsAndShowsAgainWhenItAnswers) {
  START_XVFB(640, 360);
  GlfwProjector projector({.width_px = 640, .height_px = 360});
  ASSERT_EQ(problem_of(projector.open(soon())), "none");
  for (int i = 0; i < 2; ++i) {
    server_->freeze();
    const Grey8 image = ramp8(640, 360, 10 + i);
    EXPECT_EQ(projector.show(image, in(50ms)).error().code, ErrorCode::kTimeout) << "it may only be slow";
    const auto hangs = projector.show(image, soon());
    EXPECT_EQ(hangs.error().code, ErrorCode::kIo);
    EXPECT_THAT(hangs.error().message, HasSubstr("display server does not answer"));
    const auto before = steady_clock::now();
    EXPECT_EQ(projector.check(soon()).error().code, ErrorCode::kIo);
    EXPECT_EQ(projector.open(soon()).error().code, ErrorCode::kIo);
    EXPECT_EQ(projector.read_back().error().code, ErrorCode::kIo);
    EXPECT_LT(steady_clock::now() - before, 1s) << "who knows it waits no more";
    server_->thaw();
    ASSERT_TRUE(eventually([&] { return projector.open(soon()) && projector.show(image, soon()); }));
    EXPECT_EQ(Desktop(server_->display()).screenshot(0, 0, 640, 360), as_seen(image));
  }
}

TEST_F(OnXvfb, LeavesAServerThatHangsForOneInItsPlace) {
  START_XVFB(640, 360);
  GlfwProjector projector({.width_px = 640, .height_px = 360});
  ASSERT_EQ(problem_of(projector.open(soon())), "none");
  for (int i = 0; i < 3; ++i) {
    server_->freeze();
    EXPECT_EQ(projector.check(soon()).error().code, ErrorCode::kIo);
    server_->kill();
    ASSERT_TRUE(server_->restart());
    const Grey8 image = ramp8(640, 360, i);
    ASSERT_TRUE(eventually([&] { return projector.open(soon()) && projector.show(image, soon()); }));
    EXPECT_EQ(Desktop(server_->display()).screenshot(0, 0, 640, 360), as_seen(image));
  }
}

// At any moment of it. Not while it opens: Mesa crashes where the server ends in the midst of eglInitialize().
TEST_F(OnXvfb, OutlivesAServerThatEndsWhileItShows) {
  START_XVFB(640, 360);
  const char* wanted = std::getenv("SLSD_TEST_ENDS");
  const int ends = wanted != nullptr ? std::atoi(wanted) : 6;
  std::mt19937 random(7);
  GlfwProjector projector({.width_px = 640, .height_px = 360});
  for (int i = 0; i < ends; ++i) {
    const Grey8 image = ramp8(640, 360, i);
    ASSERT_TRUE(eventually([&] { return projector.open(soon()) && projector.show(image, soon()); })) << i;
    EXPECT_EQ(Desktop(server_->display()).screenshot(0, 0, 640, 360), as_seen(image));
    static_cast<void>(projector.show(Grey8(640, 360), in(std::chrono::milliseconds(random() % 40))));
    if (i % 2 == 0) server_->freeze();
    static_cast<void>(projector.show(image, in(1ms)));
    server_->kill();
    ASSERT_TRUE(server_->restart());
  }
}

TEST_F(OnXvfb, OpensOnAServerThatHungFromTheStart) {
  START_XVFB(640, 360);
  server_->freeze();
  GlfwProjector projector({.width_px = 640, .height_px = 360});
  EXPECT_EQ(projector.open(in(10ms)).error().code, ErrorCode::kTimeout);
  EXPECT_EQ(projector.open(soon()).error().code, ErrorCode::kIo);
  server_->thaw();
  EXPECT_TRUE(eventually([&] { return projector.open(soon()).has_value(); }));
}

TEST_F(OnXvfb, IsLeftWhereTheServerHangs) {
  START_XVFB(640, 360);
  {
    GlfwProjector projector({.width_px = 640, .height_px = 360});
    ASSERT_EQ(problem_of(projector.open(soon())), "none");
    server_->freeze();
    EXPECT_EQ(projector.check(soon()).error().code, ErrorCode::kIo);
  }
  GlfwProjector next({.width_px = 640, .height_px = 360});
  EXPECT_EQ(next.open(soon()).error().code, ErrorCode::kBusy);
  server_->thaw();
  EXPECT_TRUE(eventually([&] { return next.open(soon()).has_value(); }));
}

TEST(GlfwProjector, SaysWhenThereIsNoDisplay) {
  GlfwProjector projector({});
  ::unsetenv("DISPLAY");
  for (int i = 0; i < 3; ++i) {
    const auto opened = projector.open(soon());
    ASSERT_FALSE(opened);
    EXPECT_EQ(opened.error().code, ErrorCode::kNotFound);
    EXPECT_THAT(opened.error().message, HasSubstr("DISPLAY is not set"));
  }
  ::setenv("DISPLAY", ":60999", 1);
  EXPECT_THAT(projector.open(soon()).error().message, HasSubstr(":60999"));
}

/// A desktop with an operator's monitor, DUMMY0, and the projector to its right, DUMMY1.
class OnTwoMonitors : public ::testing::Test {
 protected:
  void SetUp() override {
    server_ = XServer::start_dummy();
    if (!server_) GTEST_SKIP() << "no Xorg with the dummy driver starts here (xserver-xorg-video-dummy)";
    desktop_ = std::make_unique<Desktop>(server_->display());
    if (!plug()) GTEST_SKIP() << "xrandr does not plug a second monitor in (x11-xserver-utils)";
  }

  [[nodiscard]] bool plug() const { return desktop_->plug("DUMMY1", "1280x800", "--right-of DUMMY0"); }

  void expect_shown_exactly(GlfwProjector& projector, const Grey8& image) const {
    ASSERT_TRUE(projector.show(image, soon()));
    EXPECT_EQ(desktop_->screenshot(1024, 0, 1280, 800), as_seen(image));
  }

  std::unique_ptr<XServer> server_;
  std::unique_ptr<Desktop> desktop_;
};

TEST_F(OnTwoMonitors, TakesTheOneThatIsNotPrimary) {
  const ColourImage operators = desktop_->screenshot(0, 0, 1024, 768);
  GlfwProjector projector({});
  ASSERT_EQ(problem_of(projector.open(soon())), "none");
  EXPECT_EQ(projector.description().monitor, "DUMMY1");
  expect_shown_exactly(projector, ramp8(1280, 800));
  EXPECT_EQ(desktop_->screenshot(0, 0, 1024, 768), operators);
}

TEST_F(OnTwoMonitors, TakesTheOneThatIsNamed) {
  desktop_->set_serial("DUMMY1", "PJ-4711");
  for (const char* name : {"DUMMY1", "PJ-4711", "+1024+0"}) {
    GlfwProjector projector({.monitor = name});
    ASSERT_EQ(problem_of(projector.open(soon())), "none");
    EXPECT_EQ(projector.description().monitor, "DUMMY1");
  }
  const auto opened = GlfwProjector({.monitor = "HDMI-7"}).open(soon());
  EXPECT_EQ(opened.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(opened.error().message, AllOf(HasSubstr("HDMI-7"), HasSubstr("DUMMY0"), HasSubstr("PJ-4711")));
}

TEST_F(OnTwoMonitors, ReturnsToTheSameMonitorWheneverItIsPluggedInAgain) {
  const char* wanted = std::getenv("SLSD_TEST_REPLUGS");
  const int replugs = wanted != nullptr ? std::atoi(wanted) : 3;
  GlfwProjector projector({});
  ASSERT_EQ(problem_of(projector.open(soon())), "none");
  for (int i = 0; i < replugs; ++i) {
    expect_shown_exactly(projector, ramp8(1280, 800, i));
    const ColourImage operators = desktop_->screenshot(0, 0, 1024, 768);
    ASSERT_TRUE(desktop_->unplug("DUMMY1"));
    EXPECT_FALSE(projector.check(soon()));
    EXPECT_EQ(projector.show(ramp8(1280, 800), soon()).error().code, ErrorCode::kDisconnected);
    EXPECT_EQ(projector.open(soon()).error().code, ErrorCode::kNotFound);
    EXPECT_EQ(desktop_->screenshot(0, 0, 1024, 768), operators);
    ASSERT_TRUE(plug());
    ASSERT_TRUE(eventually([&] { return projector.open(soon()).has_value(); }));
    EXPECT_EQ(projector.description().monitor, "DUMMY1");
  }
  expect_shown_exactly(projector, ramp8(1280, 800));
}

TEST_F(OnTwoMonitors, NoticesAnotherMode) {
  GlfwProjector projector({});
  ASSERT_EQ(problem_of(projector.open(soon())), "none");
  ASSERT_TRUE(desktop_->plug("DUMMY1", "640x360", "--right-of DUMMY0"));
  EXPECT_TRUE(eventually([&] { return !projector.check(soon()); }));
  ASSERT_TRUE(eventually([&] { return projector.open(soon()).error().code == ErrorCode::kMismatch; }));
  ASSERT_TRUE(plug());
  EXPECT_TRUE(eventually([&] { return projector.open(soon()).has_value(); }));
  expect_shown_exactly(projector, ramp8(1280, 800));
}

TEST_F(OnTwoMonitors, LeavesAMonitorThatIsOff) {
  ASSERT_TRUE(desktop_->unplug("DUMMY1"));
  const auto opened = GlfwProjector({.monitor = "DUMMY1"}).open(soon());
  EXPECT_EQ(opened.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(opened.error().message, AllOf(HasSubstr("off"), HasSubstr("xrandr --output DUMMY1 --auto")));
}

TEST_F(OnTwoMonitors, TurnsTheMonitorOnWhereTheDisplayIsItsOwn) {
  ASSERT_TRUE(desktop_->unplug("DUMMY1"));
  GlfwProjector projector({.enable_output = true});
  ASSERT_EQ(problem_of(projector.open(soon())), "none");
  EXPECT_EQ(projector.description().monitor, "DUMMY1");
  expect_shown_exactly(projector, ramp8(1280, 800));
}

TEST_F(OnTwoMonitors, TurnsOnTheOnlyMonitor) {
  ASSERT_TRUE(desktop_->unplug("DUMMY1"));
  ASSERT_TRUE(desktop_->unplug("DUMMY0"));
  GlfwProjector projector({.monitor = "DUMMY0", .enable_output = true});
  ASSERT_EQ(problem_of(projector.open(soon())), "none");
  ASSERT_TRUE(projector.show(ramp8(1280, 800), soon()));
  EXPECT_EQ(desktop_->screenshot(0, 0, 1280, 800), as_seen(ramp8(1280, 800)));
}

// As a replug with the EDID of another projector leaves it: off, at another mode, under another name.
TEST_F(OnTwoMonitors, TakesTheMonitorBackWhateverItWasMeanwhile) {
  desktop_->set_serial("DUMMY1", "PJ-4711");
  GlfwProjector projector({.monitor = "PJ-4711", .enable_output = true});
  ASSERT_EQ(problem_of(projector.open(soon())), "none");
  const std::function<bool()> strokes[] = {
      [&] { return desktop_->unplug("DUMMY1"); },
      [&] { return desktop_->plug("DUMMY1", "640x360", "--right-of DUMMY0"); },
      [&] { return desktop_->plug("DUMMY1", "1920x1080", "--pos 0x0"); },
      [&] { return desktop_->xrandr("--output DUMMY1 --mode 1280x800 --pos 100x100"); },
  };
  std::mt19937 random(4);
  for (int i = 0; i < 8; ++i) {
    desktop_->set_serial("DUMMY1", "other");
    for (std::size_t stroke = random() % 3; stroke <= 3; stroke += 1 + random() % 3) EXPECT_TRUE(strokes[stroke]());
    EXPECT_TRUE(eventually([&] { return !projector.check(soon()); }));
    EXPECT_EQ(projector.open(soon()).error().code, ErrorCode::kNotFound);
    desktop_->set_serial("DUMMY1", "PJ-4711");
    ASSERT_TRUE(eventually([&] { return projector.open(soon()).has_value(); }));
    ASSERT_TRUE(projector.show(ramp8(1280, 800, i), soon()));
    EXPECT_EQ(*projector.read_back(), ramp8(1280, 800, i));
  }
}

TEST_F(OnTwoMonitors, SaysWhichModesAMonitorLacks) {
  ASSERT_TRUE(desktop_->unplug("DUMMY1"));
  const auto opened =
      GlfwProjector({.monitor = "DUMMY1", .width_px = 1000, .height_px = 700, .enable_output = true}).open(soon());
  EXPECT_EQ(opened.error().code, ErrorCode::kMismatch);
  EXPECT_THAT(opened.error().message, HasSubstr("no mode of 1000x700"));
}

TEST_F(OnTwoMonitors, WarnsOfWhatNoScreenshotShows) {
  GlfwProjector projector({});
  ASSERT_EQ(problem_of(projector.open(soon())), "none");
  EXPECT_THAT(projector.warnings(), ::testing::Not(Contains(HasSubstr("gamma"))));
  ASSERT_TRUE(desktop_->xrandr("--output DUMMY1 --gamma 1.5:1.5:1.5"));
  ASSERT_TRUE(desktop_->xrandr("--output DUMMY1 --pos 100x0"));
  ASSERT_TRUE(eventually([&] { return projector.open(soon()).has_value(); }));
  EXPECT_THAT(projector.warnings(), Contains(HasSubstr("active gamma table")));
  EXPECT_THAT(projector.warnings(), Contains(HasSubstr("mirrors DUMMY0")));
}

}  // namespace
}  // namespace slsd
