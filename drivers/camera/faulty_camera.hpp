// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/camera/camera.hpp"
#include "drivers/camera/fault.hpp"
#include "drivers/system/wake_event.hpp"

namespace slsd {

/// A camera with simulated faults, for the tests of everything above a camera. Passes all calls to the camera that it
/// holds, except at the captures that the faults name.
/// @thread thread-bound, except cancel()
class FaultyCamera final : public Camera {
 public:
  /// @param camera  not null
  /// @param faults  in any order; if several name the same capture, the first is used
  FaultyCamera(std::unique_ptr<Camera> camera, std::vector<Fault> faults);

  [[nodiscard]] const CameraDescription& description() const override { return camera_->description(); }
  void set_found(std::function<void()> found) override { camera_->set_found(std::move(found)); }
  [[nodiscard]] Result<> open() override;
  [[nodiscard]] std::chrono::nanoseconds open_time_max() const override { return camera_->open_time_max(); }
  [[nodiscard]] Result<Frame> capture(MonotonicTime deadline) override;
  void expect(Picture light) override { camera_->expect(light); }
  [[nodiscard]] Result<> set_exposure(double exposure_us) override { return camera_->set_exposure(exposure_us); }
  void tell_figures(std::vector<DriverFigure>& figures) const override { camera_->tell_figures(figures); }
  [[nodiscard]] Result<> check() override;
  void cancel() override;

 private:
  [[nodiscard]] const Fault* fault_now() const;
  [[nodiscard]] Result<Frame> capture_with(const Fault& fault, MonotonicTime deadline);
  [[nodiscard]] Result<Frame> capture_sound(MonotonicTime deadline);
  [[nodiscard]] Result<Frame> lose_frame(ErrorCode code, std::string message, MonotonicTime deadline);
  [[nodiscard]] Result<Frame> delay_frame(const Fault& fault, MonotonicTime deadline);
  [[nodiscard]] Result<Frame> age_frame(const Fault& fault, MonotonicTime deadline);
  [[nodiscard]] Result<Frame> disconnect(const Fault& fault);
  [[nodiscard]] Result<> wait_until(MonotonicTime time, MonotonicTime deadline);
  [[nodiscard]] tl::unexpected<Error> fail_here(ErrorCode code, std::string message) const;

  std::unique_ptr<Camera> camera_;
  std::vector<Fault> faults_;
  WakeEvent wake_;
  std::uint64_t captures_ = 0;
  bool connected_ = true;
  std::optional<MonotonicTime> back_at_;  ///< open() fails until then
  std::optional<MonotonicTime> stalled_until_;
};

}  // namespace slsd
