// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <chrono>
#include <functional>
#include <memory>
#include <ostream>

#include <gmock/gmock.h>

#include "drivers/projector/headless_projector.hpp"
#include "drivers/projector/projector.hpp"
#include "tests/drivers/plain_images.hpp"

namespace slsd {
namespace {

using std::chrono::steady_clock;
using test::ramp8;

struct Backend {
  const char* name;
  std::function<std::unique_ptr<Projector>()> make;
};

void PrintTo(const Backend& backend, std::ostream* out) {
  *out << backend.name;
}

class ProjectorContract : public ::testing::TestWithParam<Backend> {
 protected:
  void SetUp() override { projector_ = GetParam().make(); }

  [[nodiscard]] int width() const { return projector_->description().width_px; }
  [[nodiscard]] int height() const { return projector_->description().height_px; }

  std::unique_ptr<Projector> projector_;
};

TEST_P(ProjectorContract, SaysWhatItIs) {
  ASSERT_TRUE(projector_->open());
  EXPECT_FALSE(projector_->description().driver.empty() || projector_->description().monitor.empty());
  EXPECT_GT(width(), 0);
  EXPECT_GT(height(), 0);
}

TEST_P(ProjectorContract, IsDisconnectedBeforeItIsOpened) {
  EXPECT_EQ(projector_->show(Grey8(width(), height())).error().code, ErrorCode::kDisconnected);
  EXPECT_EQ(projector_->read_back().error().code, ErrorCode::kDisconnected);
}

TEST_P(ProjectorContract, IsBlackWheneverItIsOpened) {
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(projector_->open());
    EXPECT_EQ(projector_->read_back(), Grey8(width(), height(), 0));
    ASSERT_TRUE(projector_->show(Grey8(width(), height(), 255)));
  }
}

TEST_P(ProjectorContract, ShowsEveryPixelAsItIs) {
  ASSERT_TRUE(projector_->open());
  for (int i = 0; i < 3; ++i) {
    const Grey8 image = ramp8(width(), height(), 50 * i);
    ASSERT_TRUE(projector_->show(image));
    EXPECT_EQ(projector_->read_back(), image);
  }
}

TEST_P(ProjectorContract, WaitsForARefreshThatBeganAfterTheCall) {
  ASSERT_TRUE(projector_->open());
  const Grey8 image(width(), height(), 9);
  for (int i = 0; i < 3; ++i) {
    const MonotonicTime before = steady_clock::now();
    const auto visible = projector_->show(image);
    ASSERT_TRUE(visible);
    EXPECT_GE(*visible, before);
    EXPECT_LE(*visible, steady_clock::now());
  }
}

TEST_P(ProjectorContract, RefusesAnImageOfAnotherSizeAndKeepsTheLast) {
  ASSERT_TRUE(projector_->open());
  const Grey8 image = ramp8(width(), height());
  ASSERT_TRUE(projector_->show(image));
  for (const Grey8& other : {Grey8(width() + 1, height()), Grey8(width(), height() - 1), Grey8()})
    EXPECT_EQ(projector_->show(other).error().code, ErrorCode::kMismatch);
  EXPECT_EQ(projector_->read_back(), image);
}

INSTANTIATE_TEST_SUITE_P(
    Backends, ProjectorContract,
    ::testing::Values(Backend{"Headless",
                              [] { return std::make_unique<HeadlessProjector>(HeadlessProjectorOptions{}); }},
                      Backend{"HeadlessOddAndFast",
                              [] {
                                return std::make_unique<HeadlessProjector>(
                                    HeadlessProjectorOptions{.width_px = 641, .height_px = 3, .refresh_hz = 1000.0});
                              }}),
    [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace slsd
