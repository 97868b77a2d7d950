// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <chrono>
#include <functional>
#include <memory>
#include <ostream>

#include <gmock/gmock.h>

#include "drivers/projector/glfw/glfw_projector.hpp"
#include "drivers/projector/headless_projector.hpp"
#include "drivers/projector/projector.hpp"
#include "tests/doubles/x11/x_server.hpp"
#include "tests/drivers/plain_images.hpp"
#include "tests/drivers/projector/soon.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
using test::ramp8;
using test::soon;

/// A backend, and how to make one; null where this machine has none.
struct Backend {
  const char* name;
  std::chrono::microseconds period;  ///< of its refresh
  std::function<std::unique_ptr<Projector>()> make;
};

void PrintTo(const Backend& backend, std::ostream* out) {
  *out << backend.name;
}

/// A projector on a monitor of a server of its own.
class OnServer final : public Projector {
 public:
  OnServer(std::unique_ptr<test::XServer> server, GlfwProjectorOptions options)
      : server_(std::move(server)), projector_(std::move(options)) {}
  [[nodiscard]] const ProjectorDescription& description() const override { return projector_.description(); }
  [[nodiscard]] Result<> open(MonotonicTime deadline) override { return projector_.open(deadline); }
  [[nodiscard]] Result<MonotonicTime> show(const Grey8& image, MonotonicTime deadline) override {
    return projector_.show(image, deadline);
  }
  [[nodiscard]] Result<> check(MonotonicTime deadline) override { return projector_.check(deadline); }
  [[nodiscard]] std::vector<std::string> warnings() const override { return projector_.warnings(); }
  [[nodiscard]] Result<Grey8> read_back() override { return projector_.read_back(); }

 private:
  std::unique_ptr<test::XServer> server_;
  GlfwProjector projector_;
};

std::unique_ptr<Projector> on_xvfb(int width_px, int height_px) {
  auto server = test::XServer::start_virtual(width_px, height_px);
  if (!server) return nullptr;
  return std::make_unique<OnServer>(std::move(server),
                                    GlfwProjectorOptions{.width_px = width_px, .height_px = height_px});
}

class ProjectorContract : public ::testing::TestWithParam<Backend> {
 protected:
  void SetUp() override {
    projector_ = GetParam().make();
    if (!projector_) GTEST_SKIP() << "no Xvfb starts here (package xvfb)";
  }

  [[nodiscard]] int width() const { return projector_->description().width_px; }
  [[nodiscard]] int height() const { return projector_->description().height_px; }

  std::unique_ptr<Projector> projector_;
};

TEST_P(ProjectorContract, SaysWhatItIs) {
  ASSERT_TRUE(projector_->open(soon()));
  EXPECT_FALSE(projector_->description().driver.empty() || projector_->description().monitor.empty());
  EXPECT_GT(width(), 0);
  EXPECT_GT(height(), 0);
}

TEST_P(ProjectorContract, IsDisconnectedBeforeItIsOpened) {
  EXPECT_EQ(projector_->show(Grey8(width(), height()), soon()).error().code, ErrorCode::kDisconnected);
  EXPECT_EQ(projector_->read_back().error().code, ErrorCode::kDisconnected);
  EXPECT_EQ(projector_->check(soon()).error().code, ErrorCode::kDisconnected);
}

TEST_P(ProjectorContract, IsThereFromWhenItIsOpened) {
  ASSERT_TRUE(projector_->open(soon()));
  EXPECT_TRUE(projector_->check(soon()));
  ASSERT_TRUE(projector_->show(Grey8(width(), height()), soon()));
  EXPECT_TRUE(projector_->check(soon()));
}

TEST_P(ProjectorContract, IsBlackWheneverItIsOpened) {
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(projector_->open(soon()));
    EXPECT_EQ(projector_->read_back(), Grey8(width(), height(), 0));
    ASSERT_TRUE(projector_->show(Grey8(width(), height(), 255), soon()));
  }
}

TEST_P(ProjectorContract, ShowsEveryPixelAsItIs) {
  ASSERT_TRUE(projector_->open(soon()));
  for (int i = 0; i < 3; ++i) {
    const Grey8 image = ramp8(width(), height(), 50 * i);
    ASSERT_TRUE(projector_->show(image, soon()));
    EXPECT_EQ(projector_->read_back(), image);
  }
}

TEST_P(ProjectorContract, WaitsForARefreshThatBeganAfterTheCall) {
  ASSERT_TRUE(projector_->open(soon()));
  const Grey8 image(width(), height(), 9);
  for (int i = 0; i < 3; ++i) {
    const MonotonicTime before = steady_clock::now();
    const auto visible = projector_->show(image, soon());
    ASSERT_TRUE(visible);
    EXPECT_GE(*visible - GetParam().period, before);
    EXPECT_LE(*visible, steady_clock::now());
  }
}

TEST_P(ProjectorContract, RefusesAnImageOfAnotherSizeAndKeepsTheLast) {
  ASSERT_TRUE(projector_->open(soon()));
  const Grey8 image = ramp8(width(), height());
  ASSERT_TRUE(projector_->show(image, soon()));
  for (const Grey8& other : {Grey8(width() + 1, height()), Grey8(width(), height() - 1), Grey8()})
    EXPECT_EQ(projector_->show(other, soon()).error().code, ErrorCode::kMismatch);
  EXPECT_EQ(projector_->read_back(), image);
}

INSTANTIATE_TEST_SUITE_P(
    Backends, ProjectorContract,
    ::testing::Values(Backend{"Headless", 16666us,
                              [] { return std::make_unique<HeadlessProjector>(HeadlessProjectorOptions{}); }},
                      Backend{"HeadlessOddAndFast", 1000us,
                              [] {
                                return std::make_unique<HeadlessProjector>(
                                    HeadlessProjectorOptions{.width_px = 641, .height_px = 3, .refresh_hz = 1000.0});
                              }},
                      Backend{"Glfw", 16666us, [] { return on_xvfb(641, 363); }}),
    [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace slsd
