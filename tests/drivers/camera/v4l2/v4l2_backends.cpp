// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/drivers/camera/v4l2/v4l2_backends.hpp"

#include <cstdlib>
#include <thread>

#include "tests/drivers/camera/recording.hpp"

namespace slsd::test {
namespace {

using namespace std::chrono_literals;

/// Keeps the double as long as the camera.
class CameraOnDouble final : public Camera {
 public:
  CameraOnDouble(std::unique_ptr<V4l2Double> device, const V4l2CameraOptions& options)
      : device_(std::move(device)), camera_(options) {}
  const CameraDescription& description() const override { return camera_.description(); }
  Result<> open() override { return camera_.open(); }
  Result<Frame> capture(MonotonicTime deadline) override { return camera_.capture(deadline); }
  Result<Frame> capture_next(MonotonicTime deadline) override { return camera_.capture_next(deadline); }
  Result<> check() override { return camera_.check(); }
  void cancel() override { camera_.cancel(); }

 private:
  std::unique_ptr<V4l2Double> device_;
  V4l2Camera camera_;
};

}  // namespace

DoubleOptions quick_double() {
  DoubleOptions options;
  options.rates_hz = {500.0, 250.0};
  options.exposure = 200us;
  options.readout = 200us;
  return options;
}

DoubleOptions triggered_double() {
  DoubleOptions options = quick_double();
  options.triggered = true;
  return options;
}

std::unique_ptr<Camera> v4l2_camera_on_double(std::uint32_t fourcc) {
  DoubleOptions options = quick_double();
  options.formats = {{fourcc, {{160, 120}}}};
  options.controls = uvc_controls();
  auto device = V4l2Double::create(options);
  if (!device) return nullptr;
  V4l2CameraOptions camera;
  camera.device = (*device)->path();
  return std::make_unique<CameraOnDouble>(std::move(*device), camera);
}

std::unique_ptr<Camera> real_v4l2_camera() {
  const char* device = std::getenv("SLSD_TEST_V4L2");
  if (device == nullptr || *device == '\0') return nullptr;
  V4l2CameraOptions camera;
  camera.device = device;
  return std::make_unique<V4l2Camera>(camera);
}

bool V4l2Test::make(DoubleOptions options, V4l2CameraOptions camera) {
  if (options.triggered) {
    camera.settle_frames = 0;
    camera.missed_frames_max = 0;
  }
  auto device = V4l2Double::create(std::move(options));
  if (!device) {
    [&] { GTEST_SKIP() << to_string(device.error()); }();
    return false;
  }
  double_ = std::move(*device);
  if (camera.device.empty()) camera.device = double_->path();
  camera_ = std::make_unique<V4l2Camera>(camera);
  return true;
}

std::future<Result<Frame>> V4l2Test::begin_capture(std::chrono::nanoseconds time) {
  const std::uint64_t polls = double_->polls();
  auto frame = std::async(std::launch::async,
                          [this, time] { return camera_->capture(std::chrono::steady_clock::now() + time); });
  while (double_->polls() == polls && frame.wait_for(0s) != std::future_status::ready)
    std::this_thread::sleep_for(100us);
  return frame;
}

Result<Frame> V4l2Test::capture_one() {
  auto frame = begin_capture();
  double_->trigger();
  return frame.get();
}

Result<Frame> V4l2Test::capture() {
  return camera_->capture(far_away());
}

}  // namespace slsd::test
