// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/scanner.hpp"

#include <atomic>
#include <future>
#include <limits>
#include <mutex>

#include <gmock/gmock.h>

#include "daemon/scan/rig/devices.hpp"
#include "tests/daemon/scan/clocked_camera.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

constexpr auto kPeriod = 1ms;
constexpr double kEveryFrame = std::numeric_limits<double>::infinity();

/// A scanner on a camera that sends more frames than can be decoded.
class ScannerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const Pattern pattern = *make_pattern({});
    const Calibration calibration = paper_rig();
    frame_ = simulate(draw_pattern(pattern), calibration, plane({0, 0, 2000}, {0, 0, 1}));
    ScanSetup setup{pattern, draw_pattern(pattern), calibration, {"camera"}, {}};
    setup.lanes.resize(DecodeLanes::lanes_here());
    const Decoder decoder = std::move(*Decoder::create(pattern, calibration, 0, {}));
    for (auto& lane : setup.lanes) lane.push_back(decoder.another());
    std::vector<std::unique_ptr<Camera>> cameras;
    cameras.push_back(std::make_unique<ClockedCamera>("camera", frame_, start_, kPeriod));
    auto rig = std::make_unique<Rig>(std::move(*make_projector({})), std::move(cameras), setup.image, ScanOptions{});
    scanner_ = std::make_unique<Scanner>(std::move(rig), std::move(setup));
  }

  Result<ScanResult> scan() {
    auto answer = std::make_shared<std::promise<Result<ScanResult>>>();
    scanner_->scan({steady_clock::now() + 30s, false, {}},
                   [answer](Result<ScanResult> result) { answer->set_value(std::move(result)); });
    return answer->get_future().get();
  }

  /// Whether every frame taken so far is decoded, or was skipped.
  [[nodiscard]] bool idle() const {
    const ScanTotals totals = scanner_->totals();
    return totals.succeeded + totals.skipped == scanner_->rig().camera_statuses().at(0).frames;
  }

  const MonotonicTime start_ = steady_clock::now();
  Grey8 frame_;
  std::unique_ptr<Scanner> scanner_;
};

TEST_F(ScannerTest, EveryFrameInFreeRunIsDecodedOrCounted) {
  std::vector<std::uint64_t> frames;
  std::atomic<int> clouds{0};
  scanner_->set_listener([&](const FreeScan& scan) {
    if (*scan) frames.push_back((*scan)->cloud.frame);
    ++clouds;
  });
  scanner_->run_freely(FreeRun{kEveryFrame, {}});
  while (clouds < 20) std::this_thread::sleep_for(1ms);
  scanner_->run_freely(std::nullopt);
  const auto last = scan();
  ASSERT_TRUE(last) << to_string(last.error());
  EXPECT_GT(scanner_->totals().skipped, 0U);
  EXPECT_TRUE(idle());
  EXPECT_TRUE(std::ranges::is_sorted(frames));
}

TEST_F(ScannerTest, FreeRunAfterAPauseTakesNoFrameOfBefore) {
  std::atomic<std::uint64_t> clouds{0};
  std::atomic<std::uint64_t> frame{0};
  scanner_->set_listener([&](const FreeScan& scan) {
    frame = *scan ? (*scan)->cloud.frame : 0;
    ++clouds;
  });
  scanner_->run_freely(FreeRun{kEveryFrame, {}});
  while (clouds < 5) std::this_thread::sleep_for(1ms);
  scanner_->run_freely(std::nullopt);
  std::this_thread::sleep_for(100ms);
  // Statistics count a scan a little before its listener hears of it: that cloud would be taken for the first after the
  // pause.
  const auto all_concluded = [&] {
    return clouds + scanner_->totals().skipped == scanner_->rig().camera_statuses().at(0).frames;
  };
  while (!all_concluded()) std::this_thread::sleep_for(1ms);
  const std::uint64_t before = clouds;
  const auto resumed = static_cast<std::uint64_t>((steady_clock::now() - start_) / kPeriod);
  scanner_->run_freely(FreeRun{kEveryFrame, {}});
  while (clouds == before) std::this_thread::sleep_for(1ms);
  EXPECT_GE(frame, resumed);
  scanner_.reset();  // scans on, and would tell what is no longer there
}

TEST_F(ScannerTest, ScanTellsSkewAndWhenItsFramesWereThere) {
  const auto before = steady_clock::now();
  const auto result = scan();
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_EQ(result->skew, 0ns);
  EXPECT_GT(result->received, before);
  EXPECT_LT(result->received + result->decode_time, steady_clock::now());
}

TEST_F(ScannerTest, StopAnswersEveryRequestOnce) {
  constexpr int kRequests = 30;
  std::atomic<int> answers{0};
  for (int i = 0; i < kRequests; ++i) {
    scanner_->scan({steady_clock::now() + 30s, false, {}}, [&](const Result<ScanResult>& result) {
      if (!result) {
        EXPECT_EQ(result.error().code, ErrorCode::kCancelled);
      }
      ++answers;
    });
  }
  scanner_->request_stop();
  EXPECT_TRUE(scanner_->wait_stopped(30s));
  EXPECT_EQ(answers, kRequests);
}

}  // namespace
}  // namespace slsd
