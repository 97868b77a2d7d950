// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>

#include "drivers/camera/aravis/aravis_camera.hpp"
#include "drivers/camera/camera.hpp"
#include "tests/doubles/gige/gige_camera.hpp"

namespace slsd::test {

/// Options to reach the double, that wait long enough on a busy machine.
[[nodiscard]] inline AravisCameraOptions options_for(const GigeCamera& device) {
  AravisCameraOptions options;
  options.id = device.address();
  options.packet_bytes = 1400;
  options.packet_socket = false;
  options.frame_timeout_ms = 10000;
  return options;
}

/// An AravisCamera and the double that it finds.
class CameraOnDouble final : public Camera {
 public:
  CameraOnDouble(GigeCameraOptions device, AravisCameraOptions options) : device_(std::move(device)) {
    options.id = device_.address();
    camera_ = std::make_unique<AravisCamera>(std::move(options));
  }

  [[nodiscard]] const CameraDescription& description() const override { return camera_->description(); }
  [[nodiscard]] Result<> open() override { return camera_->open(); }
  [[nodiscard]] Result<Frame> capture(MonotonicTime deadline) override { return camera_->capture(deadline); }
  [[nodiscard]] Result<Frame> capture_next(MonotonicTime deadline) override { return camera_->capture_next(deadline); }
  [[nodiscard]] Result<> check() override { return camera_->check(); }
  void cancel() override { camera_->cancel(); }

 private:
  GigeCamera device_;
  std::unique_ptr<AravisCamera> camera_;
};

}  // namespace slsd::test
