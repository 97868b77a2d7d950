// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// Scans of cameras that take two exposures of each picture.
#include <algorithm>
#include <deque>
#include <random>

#include <gmock/gmock.h>

#include "core/exposure/merge_exposures.hpp"
#include "daemon/scan/cloud/merge_frames.hpp"
#include "daemon/scan/cloud/reconstruct.hpp"
#include "daemon/scan/rig/rig.hpp"
#include "drivers/projector/headless_projector.hpp"
#include "tests/simulator/simulator.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::vector<double> kTwo{1000, 4000};
constexpr double kNoise = 2;  // levels

/// A camera on a still scene, which notes its exposures.
class ExposingCamera final : public Camera {
 public:
  /// @param scene  its levels at 1000 us, without a limit
  ExposingCamera(std::string name, const Image<float>& scene) : scene_(scene) {
    description_ = {std::move(name), "exposing", "exposing", scene.width(), scene.height()};
  }

  [[nodiscard]] const CameraDescription& description() const override { return description_; }
  [[nodiscard]] Result<> open() override { return {}; }
  [[nodiscard]] Result<> set_exposure(double exposure_us) override {
    if (refuses) return fail(ErrorCode::kMismatch, "the camera does not take it");
    exposure_us_ = exposure_us;
    return {};
  }
  [[nodiscard]] Result<Frame> capture(MonotonicTime) override {
    exposures.push_back(exposure_us_);
    if (exposures.size() == lost_at) return fail(ErrorCode::kFrameDropped, "lost");
    const double us = ignores ? 1000 : exposure_us_;
    Grey8& image = images_.emplace_back(scene_.width(), scene_.height());
    std::normal_distribution<double> noise(0, kNoise);
    std::transform(scene_.data(), scene_.data() + scene_.size(), image.data(), [&](float level) {
      return static_cast<std::uint8_t>(std::clamp(level * us / 1000 + noise(random_) + 0.5, 0.0, 255.0));
    });
    const auto now = steady_clock::now();
    return Frame(image.view(), exposures.size(), now, now);
  }
  void cancel() override {}

  std::vector<double> exposures;  ///< of each capture
  std::size_t lost_at = 0;        ///< this capture fails, counted from 1
  bool ignores = false;           ///< exposes as before, whatever is set
  bool refuses = false;

 private:
  const Image<float>& scene_;
  CameraDescription description_;
  std::deque<Grey8> images_;
  double exposure_us_ = 0;
  std::mt19937 random_{7};
};

/// A plane that is dark on the left: 1000 us give little more than noise there, and 4000 us saturate the right.
class TwoExposures : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    pattern_ = new Pattern(*make_pattern({}));
    const Grey8 even = simulate(draw_pattern(*pattern_), paper_rig(), plane({0, 0, 2000}, {0, 0, 1}));
    scene_ = new Image<float>(even.width(), even.height());
    for (int y = 0; y < even.height(); ++y)
      for (int x = 0; x < even.width(); ++x)
        scene_->at(x, y) = static_cast<float>(even.at(x, y)) * (x < even.width() / 2 ? 0.05F : 0.9F);
  }
  static void TearDownTestSuite() {
    delete scene_;
    delete pattern_;
  }

  void make(const std::vector<std::vector<double>>& exposures_us) {
    Calibration calibration = paper_rig();
    std::vector<std::unique_ptr<Camera>> cameras;
    calibration.cameras.resize(exposures_us.size(), calibration.cameras[0]);
    setup_.emplace(ScanSetup{*pattern_, draw_pattern(*pattern_), calibration, {}, {}});
    setup_->lanes.resize(1);
    for (std::size_t i = 0; i < exposures_us.size(); ++i) {
      auto camera = std::make_unique<ExposingCamera>("camera" + std::to_string(i), *scene_);
      cameras_.push_back(camera.get());
      cameras.push_back(std::move(camera));
      setup_->camera_names.push_back("camera" + std::to_string(i));
      setup_->lanes[0].push_back(std::move(*Decoder::create(*pattern_, calibration, i, {})));
    }
    rig_ = std::make_unique<Rig>(std::make_unique<HeadlessProjector>(HeadlessProjectorOptions{}), std::move(cameras),
                                 setup_->image, ScanOptions{.timeout_ms = 60'000, .exposure_skew_ms = 10'000},
                                 exposures_us);
  }

  Result<FrameSet> capture(LightFrames light = {}) {
    WaitLimit limit(steady_clock::now() + 60s);
    limit.again = [](const Error& error) { return error.code == ErrorCode::kFrameDropped; };
    return rig_->capture(limit, Exposure::kFresh, light);
  }

  std::size_t points_of(const FrameSet& set) {
    const auto result = reconstruct(set, *setup_, 0, {}, "scan");
    EXPECT_TRUE(result);
    return result ? result->cloud.points.size() : 0;
  }

  static Pattern* pattern_;
  static Image<float>* scene_;
  std::vector<ExposingCamera*> cameras_;
  std::optional<ScanSetup> setup_;
  std::unique_ptr<Rig> rig_;
};

Pattern* TwoExposures::pattern_ = nullptr;
Image<float>* TwoExposures::scene_ = nullptr;

TEST_F(TwoExposures, MergedGiveMorePointsThanEither) {
  make({{}});
  auto one = capture();
  ASSERT_TRUE(one);
  make({kTwo});
  auto both = capture();
  ASSERT_TRUE(both) << to_string(both.error());
  FrameSet longer;
  longer.frames.push_back(std::move(*both->longer[0]));
  const std::size_t of_longer = points_of(longer);
  both = capture();
  ASSERT_TRUE(both);
  const std::size_t of_shorter = points_of(*both);
  const auto merged = merge_frames(*both, *setup_);
  ASSERT_EQ(merged.size(), 1U);
  EXPECT_EQ(merged[0].name, "camera0");
  EXPECT_EQ(merged[0].problem, "");
  EXPECT_EQ(both->frames[0].image().index(), 1U) << "16 bits";
  EXPECT_FALSE(both->longer[0]) << "returned to its driver";
  const std::size_t of_both = points_of(*both);
  EXPECT_GT(of_both, of_shorter + 100);
  EXPECT_GE(of_both, of_longer);
}

TEST_F(TwoExposures, AreTakenOfEachPictureInOrder) {
  make({kTwo});
  auto set = capture({.white = true, .dark = true});
  ASSERT_TRUE(set) << to_string(set.error());
  EXPECT_THAT(cameras_[0]->exposures, ElementsAre(1000, 4000, 1000, 4000, 1000, 4000));
  EXPECT_THAT(set->exposure_ratios, ElementsAre(4));
  EXPECT_EQ(merge_frames(*set, *setup_).at(0).problem, "");
  for (const auto* frames : {&set->frames, &set->white, &set->dark}) {
    ASSERT_EQ(frames->size(), 1U);
    EXPECT_EQ((*frames)[0].image().index(), 1U);
  }
  ASSERT_TRUE(rig_->capture_one(0, WaitLimit(steady_clock::now() + 60s)));
  EXPECT_EQ(cameras_[0]->exposures.back(), 1000) << "a single frame has the shorter exposure";
}

TEST_F(TwoExposures, GiveTheColoursOfTheShorterOneAndReturnItsBuffer) {
  make({kTwo});
  auto set = capture({.white = true});
  ASSERT_TRUE(set) << to_string(set.error());
  const auto buffer = std::make_shared<LentBuffers>(1);
  for (auto& [frame, red] : {std::pair(&set->white[0], 20), std::pair(&*set->longer_white[0], 80)}) {
    Frame coloured(frame->image(), 1, frame->exposure_start(), frame->received(),
                   red == 20 ? buffer->lend(0) : FrameLease());
    const ColourFrame colours(1600, 1200, {static_cast<std::uint16_t>(red), 30, 40});
    *frame = std::move(coloured).with_colours([colours] { return colours; });
  }
  ASSERT_TRUE(buffer->is_lent(0));
  EXPECT_EQ(merge_frames(*set, *setup_).at(0).problem, "");
  EXPECT_FALSE(buffer->is_lent(0)) << "the driver needs it";
  ScanRequest request;
  request.texture = request.colour = true;
  const auto result = reconstruct(*set, *setup_, 0, request, "scan");
  ASSERT_TRUE(result) << to_string(result.error());
  ASSERT_GT(result->cloud.points.size(), 1000U);
  for (const CloudPoint& point : result->cloud.points) ASSERT_EQ(point.colour, (Rgb{20, 30, 40}));
}

TEST_F(TwoExposures, ConcernOnlyCamerasThatHaveThem) {
  make({{}, kTwo});
  auto set = capture();
  ASSERT_TRUE(set) << to_string(set.error());
  EXPECT_EQ(cameras_[0]->exposures.size(), 1U);
  EXPECT_THAT(cameras_[1]->exposures, ElementsAre(1000, 4000));
  const auto merged = merge_frames(*set, *setup_);
  ASSERT_EQ(merged.size(), 1U);
  EXPECT_EQ(merged[0].name, "camera1");
  EXPECT_EQ(set->frames[0].image().index(), 0U);
  EXPECT_EQ(set->frames[1].image().index(), 1U);
  const auto result = reconstruct(*set, *setup_, 0, {}, "scan");
  ASSERT_TRUE(result);
  EXPECT_THAT(result->full_levels, ElementsAre(255, kMergedFull));
}

TEST_F(TwoExposures, AreBothTakenAgainIfOneIsLost) {
  for (const std::size_t lost_at : {1, 2}) {
    make({kTwo});
    cameras_.back()->lost_at = lost_at;
    ASSERT_TRUE(capture());
    auto expected = lost_at == 1 ? std::vector<double>{1000, 1000, 4000} : std::vector<double>{1000, 4000, 1000, 4000};
    EXPECT_EQ(cameras_.back()->exposures, expected);
  }
}

TEST_F(TwoExposures, LeaveTheShorterOneIfTheCameraIgnoresThem) {
  make({kTwo});
  cameras_[0]->ignores = true;
  auto set = capture({.white = true});
  ASSERT_TRUE(set);
  const Grey16 shorter = as_merged(set->frames[0].image(), 255);
  const auto merged = merge_frames(*set, *setup_);
  ASSERT_EQ(merged.size(), 1U);
  EXPECT_THAT(merged[0].problem, HasSubstr("1.00 times as bright"));
  const auto left = std::get<ImageView<std::uint16_t>>(set->frames[0].image());
  EXPECT_TRUE(std::equal(shorter.data(), shorter.data() + shorter.size(), left.pixels)) << "in merged levels";
  EXPECT_GT(points_of(*set), 1000U);
}

TEST_F(TwoExposures, FailTheScanIfTheCameraRefusesOne) {
  make({kTwo});
  cameras_[0]->refuses = true;
  const auto set = capture();
  ASSERT_FALSE(set);
  EXPECT_EQ(set.error().code, ErrorCode::kMismatch);
  EXPECT_EQ(set.error().where, "camera camera0");
  EXPECT_THAT(cameras_[0]->exposures, IsEmpty());
}

}  // namespace
}  // namespace slsd
