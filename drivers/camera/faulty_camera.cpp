// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/faulty_camera.hpp"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

namespace slsd {
namespace {

using std::chrono::steady_clock;

constexpr std::chrono::milliseconds kStaleBy{100};

}  // namespace

FaultyCamera::FaultyCamera(std::unique_ptr<Camera> camera, std::vector<Fault> faults)
    : camera_(std::move(camera)), faults_(std::move(faults)) {}

Result<> FaultyCamera::open() {
  if (back_at_ && steady_clock::now() < *back_at_)
    return fail_here(ErrorCode::kDisconnected, "still unplugged; try again");
  stalled_until_.reset();
  wake_.reset();
  if (auto wake = wake_.open(); !wake) return wake;
  auto opened = camera_->open();
  connected_ = opened.has_value();
  return opened;
}

Result<Frame> FaultyCamera::capture(MonotonicTime deadline) {
  if (!connected_) return fail_here(ErrorCode::kDisconnected, "the camera is gone; open it again");
  ++captures_;
  const Fault* fault = fault_now();
  if (fault != nullptr && fault->kind == FaultKind::kStall)
    stalled_until_ = fault->duration ? steady_clock::now() + *fault->duration : MonotonicTime::max();
  if (fault != nullptr && fault->kind == FaultKind::kHang) {
    std::this_thread::sleep_for(fault->duration.value_or(std::chrono::hours(24 * 365)));
  }
  if (stalled_until_) {
    if (auto waited = wait_until(*stalled_until_, deadline); !waited) return tl::unexpected(waited.error());
    stalled_until_.reset();
  }
  return fault != nullptr ? capture_with(*fault, deadline) : capture_sound(deadline);
}

Result<> FaultyCamera::check() {
  if (!connected_) return fail_here(ErrorCode::kDisconnected, "the camera is gone; open it again");
  return camera_->check();
}

void FaultyCamera::cancel() {
  wake_.wake();
  camera_->cancel();
}

const Fault* FaultyCamera::fault_now() const {
  const auto found =
      std::find_if(faults_.begin(), faults_.end(), [this](const Fault& fault) { return fault.capture == captures_; });
  return found == faults_.end() ? nullptr : &*found;
}

Result<Frame> FaultyCamera::capture_with(const Fault& fault, MonotonicTime deadline) {
  switch (fault.kind) {
    case FaultKind::kDrop:
      return lose_frame(ErrorCode::kFrameDropped, "a frame was lost in transit; scan again", deadline);
    case FaultKind::kTear:
      return lose_frame(ErrorCode::kFrameTorn, "only part of the frame arrived; scan again", deadline);
    case FaultKind::kLate:
      return delay_frame(fault, deadline);
    case FaultKind::kStale:
      return age_frame(fault, deadline);
    case FaultKind::kDisconnect:
      return disconnect(fault);
    case FaultKind::kStall:
    case FaultKind::kHang:
      break;
  }
  return capture_sound(deadline);
}

Result<Frame> FaultyCamera::capture_sound(MonotonicTime deadline) {
  while (true) {
    auto frame = camera_->capture(deadline);
    if (frame || frame.error().code != ErrorCode::kCancelled) return frame;
    // cancel() wakes both. If ours was not woken, this wake remains from a cancel() that was answered here.
    if (wake_.sleep_until(MonotonicTime::min())) return frame;
  }
}

Result<Frame> FaultyCamera::lose_frame(ErrorCode code, std::string message, MonotonicTime deadline) {
  const auto frame = capture_sound(deadline);
  if (!frame) return tl::unexpected(frame.error());
  return fail_here(code, std::move(message));
}

Result<Frame> FaultyCamera::delay_frame(const Fault& fault, MonotonicTime deadline) {
  auto frame = capture_sound(deadline);
  if (!frame) return frame;
  const MonotonicTime arrival = fault.duration ? frame->received() + *fault.duration : MonotonicTime::max();
  if (auto waited = wait_until(arrival, deadline); !waited) return tl::unexpected(waited.error());
  const MonotonicTime exposure_start = frame->exposure_start();
  return std::move(*frame).restamped(exposure_start, arrival);
}

Result<Frame> FaultyCamera::age_frame(const Fault& fault, MonotonicTime deadline) {
  const MonotonicTime trigger = steady_clock::now();
  auto frame = capture_sound(deadline);
  if (!frame) return frame;
  const MonotonicTime received = frame->received();
  return std::move(*frame).restamped(trigger - fault.duration.value_or(kStaleBy), received);
}

Result<Frame> FaultyCamera::disconnect(const Fault& fault) {
  connected_ = false;
  back_at_ = steady_clock::now() + fault.duration.value_or(std::chrono::nanoseconds::zero());
  return fail_here(ErrorCode::kDisconnected, "the camera is gone; check its cable and open it again");
}

Result<> FaultyCamera::wait_until(MonotonicTime time, MonotonicTime deadline) {
  if (wake_.sleep_until(std::min(time, deadline))) return fail_here(ErrorCode::kCancelled, "the capture was cancelled");
  if (time > deadline) return fail_here(ErrorCode::kFrameLate, "no frame arrived before the deadline; scan again");
  return {};
}

tl::unexpected<Error> FaultyCamera::fail_here(ErrorCode code, std::string message) const {
  return fail(code, std::move(message), camera_->description().name);
}

}  // namespace slsd
