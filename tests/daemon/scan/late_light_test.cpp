// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/daemon/scan/late_light.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <future>
#include <iostream>
#include <limits>
#include <memory>
#include <random>
#include <string>

#include <gmock/gmock.h>

#include "daemon/scan/scanner.hpp"
#include "drivers/files/encode_png.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

constexpr double kRefreshHz = 400;
constexpr auto kRefresh = 2'500us;
constexpr int kLatest = 6;
enum : std::size_t { kPattern, kBlack, kWhite, kOther };

int scans_asked_for() {
  const char* text = std::getenv("SLSD_TEST_LATE_SCANS");
  return text != nullptr ? std::max(1, std::atoi(text)) : 60;
}

/// A scanner whose projector is late by whole refreshes and shows other pictures between scans: black when idle, white,
/// black or another pattern by hand.
class LateLightTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    calibration_ = new Calibration(paper_rig());
    pattern_ = new Pattern(*make_pattern({}));
    decoder_ = new Decoder(std::move(*Decoder::create(*pattern_, *calibration_, 0, {})));
    PatternOptions other;
    other.seed = 2;
    pictures_ = new std::vector<LateLight::Picture>;
    for (const Grey8& shown :
         {draw_pattern(*pattern_), Grey8(1280, 800, 0), Grey8(1280, 800, 255), draw_pattern(*make_pattern(other))}) {
      pictures_->push_back({shown, simulate(shown, *calibration_, plane({0, 0, 2000}, {0, 0, 1}))});
    }
    other_png_ = new std::string(*encode_png((*pictures_)[kOther].shown));
  }
  static void TearDownTestSuite() {
    delete other_png_;
    delete pictures_;
    delete decoder_;
    delete pattern_;
    delete calibration_;
  }

  void start(int late_refreshes, double latency_ms, std::chrono::nanoseconds camera_period) {
    scanner_.reset();
    light_ = std::make_unique<LateLight>(*pictures_, kRefresh, late_refreshes);
    ScanSetup setup{*pattern_, (*pictures_)[kPattern].shown, *calibration_, {"camera"}, {}};
    setup.lanes.resize(DecodeLanes::lanes_here());
    for (auto& lane : setup.lanes) lane.push_back(decoder_->another());
    std::vector<std::unique_ptr<Camera>> cameras;
    cameras.push_back(std::make_unique<LightCamera>(*light_, camera_period));
    ScanOptions options;
    options.projector_latency_ms = latency_ms;
    auto projector = std::make_unique<LateHeadless>(*light_, HeadlessProjectorOptions{.refresh_hz = kRefreshHz});
    auto rig = std::make_unique<Rig>(std::move(projector), std::move(cameras), setup.image, options);
    rig->set_idle(Grey8(1280, 800, 0), 0ms);
    scanner_ = std::make_unique<Scanner>(std::move(rig), std::move(setup));
  }

  void pause(double refreshes_max) {
    std::this_thread::sleep_for(kRefresh * std::uniform_real_distribution<>(0, refreshes_max)(random_));
  }

  /// @return when it is shown
  std::future<void> project_something() {
    const auto answered = std::make_shared<std::promise<void>>();
    ProjectRequest request;
    request.deadline = steady_clock::now() + 60s;
    switch (random_() % 4) {
      case 0:
        request.picture = Picture::kWhite;
        break;
      case 1:
        request.picture = Picture::kImage;
        request.png = *other_png_;
        break;
      default:
        answered->set_value();  // the idle picture comes by itself
        return answered->get_future();
    }
    scanner_->project(request, [answered](const Result<>& shown) {
      EXPECT_TRUE(shown) << to_string(shown.error());
      answered->set_value();
    });
    return answered->get_future();
  }

  /// Whether a scan's cloud is that of another picture than its pattern, or is no plane.
  [[nodiscard]] bool is_wrong(const ScanResult& scan) const {
    const LateLight::Sight sight = light_->sight_of(scan.cloud.frame);
    if (sight.picture != kPattern || sight.other) return true;
    const auto on_plane = [](const CloudPoint& point) { return std::abs(point.z - 2000) < 20; };
    return scan.cloud.points.size() < 2000 || !std::ranges::all_of(scan.cloud.points, on_plane);
  }

  Result<ScanResult> scan(const ScanRequest& request) {
    auto answer = std::make_shared<std::promise<Result<ScanResult>>>();
    scanner_->scan(request, [answer](Result<ScanResult> result) { answer->set_value(std::move(result)); });
    return answer->get_future().get();
  }

  /// @return clouds from a wrong picture
  int scan_around_changes(int scans) {
    int wrong = 0;
    for (int i = 0; i < scans; ++i) {
      project_something();
      pause(kLatest + 2);
      const auto result = scan({steady_clock::now() + 60s, false, {}});
      EXPECT_TRUE(result) << to_string(result.error());
      wrong += result && is_wrong(*result) ? 1 : 0;
      pause(2);
    }
    return wrong;
  }

  static Calibration* calibration_;
  static Pattern* pattern_;
  static Decoder* decoder_;
  static std::vector<LateLight::Picture>* pictures_;
  static std::string* other_png_;
  std::mt19937 random_{7};
  std::unique_ptr<LateLight> light_;  ///< outlives the scanner
  std::unique_ptr<Scanner> scanner_;
};

Calibration* LateLightTest::calibration_ = nullptr;
Pattern* LateLightTest::pattern_ = nullptr;
Decoder* LateLightTest::decoder_ = nullptr;
std::vector<LateLight::Picture>* LateLightTest::pictures_ = nullptr;
std::string* LateLightTest::other_png_ = nullptr;

double milliseconds(int refreshes) {
  return refreshes * std::chrono::duration<double, std::milli>(kRefresh).count();
}

TEST_F(LateLightTest, NoCloudIsFromAWrongPicture) {
  const int scans = scans_asked_for();
  int wrong = 0, done = 0;
  for (int late = 1; late <= kLatest; ++late) {
    for (const auto camera_period : {0us, 3'700us}) {
      const int now = (scans - done) / (2 * (kLatest - late) + (camera_period == 0us ? 2 : 1));
      start(late, milliseconds(late), camera_period);
      wrong += scan_around_changes(now);
      done += now;
    }
  }
  EXPECT_EQ(done, scans);
  EXPECT_EQ(wrong, 0);
  std::cout << wrong << " clouds from a wrong picture in " << done << " scans around changes of it, 1 to " << kLatest
            << " refreshes late\n";
}

TEST_F(LateLightTest, FreeRunHasNoCloudFromAWrongPicture) {
  start(3, milliseconds(3), 3'700us);
  std::atomic<int> clouds{0}, wrong{0};
  scanner_->set_listener([&](const FreeScan& scan) {
    if (!*scan) return;
    ++clouds;
    if (is_wrong(**scan)) ++wrong;
  });
  scanner_->run_freely(FreeRun{std::numeric_limits<double>::infinity(), {}});
  while (clouds < 40) {
    project_something().wait();  // else requests take all of a slow machine's time from the scans
    pause(30);
  }
  scanner_.reset();
  EXPECT_EQ(wrong, 0);
}

TEST_F(LateLightTest, EveryFrameSeesItsOwnLightAlone) {
  for (const auto camera_period : {0us, 3'700us}) {
    start(4, milliseconds(4), camera_period);
    for (int i = 0; i < 10; ++i) {
      project_something();
      pause(kLatest);
      ScanRequest request{steady_clock::now() + 60s, false, {}, FrameCoding::kRaw};
      request.texture = i % 3 != 1;
      request.ambient = i % 3 != 2;
      const auto result = scan(request);
      ASSERT_TRUE(result) << to_string(result.error());
      ASSERT_EQ(result->frames.size(), 1U + (request.texture ? 1 : 0) + (request.ambient ? 1 : 0));
      for (const FrameImage& frame : result->frames) {
        const std::size_t expected = frame.light == Picture::kPattern ? kPattern
                                     : frame.light == Picture::kWhite ? kWhite
                                                                      : kBlack;
        EXPECT_EQ(light_->sight_of(frame.sequence).picture, expected);
        EXPECT_FALSE(light_->sight_of(frame.sequence).other);
      }
      EXPECT_FALSE(is_wrong(*result));
      EXPECT_EQ(result->saturated.has_value(), request.texture);
    }
  }
}

// What the others would find where the scanner did not wait.
TEST_F(LateLightTest, FindsCloudsFromAWrongPictureWhereTheLatencyIsNotKnown) {
  start(kLatest, 0, 0us);
  int wrong = 0;
  for (int i = 0; i < 100 && wrong == 0; ++i) wrong = scan_around_changes(10);
  EXPECT_GT(wrong, 0);
}

}  // namespace
}  // namespace slsd
