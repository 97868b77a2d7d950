// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/frames/frame_capture.hpp"

#include <algorithm>
#include <utility>

#include "drivers/camera/aravis/aravis_camera_options.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

constexpr auto kQuietLeast = 50ms;
constexpr int kStaleMax = 5;

}  // namespace

FrameCapture::FrameCapture(const AravisCameraOptions& options, const std::string& device_name, CaptureEvents& events,
                           FrameReceiver& receiver, DeviceControl& control, ActionGroup::Member* action)
    : options_(options),
      device_name_(device_name),
      events_(events),
      receiver_(receiver),
      control_(control),
      action_(action) {}

Result<> FrameCapture::check() const {
  if (const std::string reason = events_.lost_reason(); !reason.empty()) return lost(reason);
  return {};
}

Result<> FrameCapture::may_capture(MonotonicTime deadline) {
  passed_over_ = 0;
  if (events_.take_cancel()) return fail_here(ErrorCode::kCancelled, "the capture was cancelled");
  if (deadline <= steady_clock::now()) return fail_here(ErrorCode::kFrameLate, "the deadline has passed");
  if (receiver_.all_held()) return fail_here(ErrorCode::kBusy, "all frames are held; release some first");
  return {};
}

// Without a clock, a frame may come sooner than its exposure allows. It may answer an earlier command, or the camera
// may expose for less time than it reports. After silence, the second command decides.
Result<Frame> FrameCapture::capture(MonotonicTime deadline) {
  if (auto may = may_capture(deadline); !may) return tl::unexpected(may.error());
  auto frame = expose(deadline, false);
  const bool too_soon = !frame && frame.error().code == ErrorCode::kFrameStale;
  return too_soon && goes_by_arrival() ? expose(deadline, true) : std::move(frame);
}

Result<Frame> FrameCapture::expose(MonotonicTime deadline, bool was_quiet) {
  if (auto settled = settle(deadline); !settled) return tl::unexpected(settled.error());
  const MonotonicTime asked = steady_clock::now();
  trigger(asked);
  return await_frame(asked, deadline, was_quiet);
}

void FrameCapture::trigger(MonotonicTime now) {
  if (action_) return action_->trigger([this] { return action_time(); });
  if (options_.trigger != AravisTrigger::kSoftware) return;
  triggered_ = now;
  ++frames_due_;
  control_.trigger();
}

// A clock that follows the network's counts nanoseconds.
std::optional<std::uint64_t> FrameCapture::action_time() const {
  if (options_.action_lead_us == 0.0 || !control_.follows_network()) return std::nullopt;
  const MonotonicTime when = steady_clock::now() + from_us(options_.action_lead_us);
  return static_cast<std::uint64_t>(control_.clock().device_time(when).count());
}

// After a pause, waiting frames are old, and the time limit of the frame is over.
Result<Frame> FrameCapture::capture_since(MonotonicTime since, MonotonicTime deadline) {
  const auto age_max = std::min(next_frame_age_max(options_), frame_timeout(options_) / 2);
  if (steady_clock::now() - since > age_max) return capture(deadline);
  if (auto may = may_capture(deadline); !may) return tl::unexpected(may.error());
  return await_frame(since, deadline);
}

// Frames of cancelled or late captures must have come, or been given up, before the next trigger. Only a frame's time
// shows which trigger it answers.
Result<> FrameCapture::settle(MonotonicTime deadline) {
  while (events_.take_buffer()) {
    receiver_.discard();
    if (frames_due_ > 0) --frames_due_;
  }
  if (options_.trigger != AravisTrigger::kSoftware) return {};
  if (out_of_step_)
    if (auto quiet = wait_until_quiet(deadline); !quiet) return quiet;
  const MonotonicTime limit = std::min(deadline, triggered_ + frame_timeout(options_));
  while (frames_due_ > 0 || !events_.trigger_answered()) {
    const auto wake = frames_due_ > 0 ? events_.wait_buffer(limit) : events_.wait_trigger_answered(limit);
    if (wake == CaptureEvents::Wake::kLost) return lost(events_.lost_reason());
    if (wake == CaptureEvents::Wake::kCancelled) return fail_here(ErrorCode::kCancelled, "the capture was cancelled");
    if (wake == CaptureEvents::Wake::kTimeout) {
      if (deadline <= limit)
        return fail_here(ErrorCode::kFrameLate, "the frame of the previous trigger has not arrived yet");
      const auto error = missed(deadline);
      if (error.value().code == ErrorCode::kDisconnected) return error;
    } else if (frames_due_ > 0) {
      receiver_.discard();
      --frames_due_;
    }
  }
  return {};
}

// Otherwise, after one frame of an earlier trigger, each capture would get the previous capture's frame for ever.
Result<> FrameCapture::wait_until_quiet(MonotonicTime deadline) {
  const auto quiet = std::min<std::chrono::nanoseconds>(from_us(options_.exposure_us) + 2 * longest_wait_ + kQuietLeast,
                                                        frame_timeout(options_));
  for (;;) {
    const auto wake = events_.wait_buffer(std::min(deadline, steady_clock::now() + quiet));
    if (wake == CaptureEvents::Wake::kLost) return lost(events_.lost_reason());
    if (wake == CaptureEvents::Wake::kCancelled) return fail_here(ErrorCode::kCancelled, "the capture was cancelled");
    if (wake == CaptureEvents::Wake::kTimeout) break;
    receiver_.discard();
  }
  receiver_.discard_all();
  frames_due_ = 0;
  out_of_step_ = false;
  return {};
}

Result<Frame> FrameCapture::await_frame(MonotonicTime asked, MonotonicTime deadline, bool was_quiet) {
  const bool paced = options_.trigger != AravisTrigger::kLine;
  MonotonicTime heard = asked;
  MonotonicTime limit = paced ? std::min(deadline, heard + frame_timeout(options_)) : deadline;
  for (;;) {
    switch (events_.wait_buffer(limit)) {
      case CaptureEvents::Wake::kCancelled:
        return fail_here(ErrorCode::kCancelled, "the capture was cancelled");
      case CaptureEvents::Wake::kLost:
        return lost(events_.lost_reason());
      case CaptureEvents::Wake::kTimeout:
        if (deadline <= limit && steady_clock::now() - heard < frame_timeout(options_)) return late();
        return missed(deadline);
      case CaptureEvents::Wake::kBuffer:
        if (auto judged = judge(asked, was_quiet)) return std::move(*judged);
        // Frames timed by arrival are skipped on a slow link, although the camera is present.
        if (!paced || !goes_by_arrival()) continue;
        heard = steady_clock::now();
        limit = std::min(deadline, heard + frame_timeout(options_));
    }
  }
}

// Skips stale frames of a line or clock that continues, and late frames of an abandoned trigger.
std::optional<Result<Frame>> FrameCapture::judge(MonotonicTime asked, bool was_quiet) {
  const DeviceClock clock = control_.clock();
  auto taken = receiver_.take({asked, clock, was_quiet});
  const bool software = options_.trigger == AravisTrigger::kSoftware;
  const bool stale = !taken && taken.error().code == ErrorCode::kFrameStale;
  if (stale && !software) return ++passed_over_, std::nullopt;
  if (!taken && software && frames_missed_ > 0) return --frames_missed_, std::nullopt;
  if (frames_due_ > 0) --frames_due_;
  out_of_step_ = stale;
  stale_in_a_row_ = stale ? stale_in_a_row_ + 1 : 0;
  // Synchronizing again did not help: the next session checks the clock anew.
  if (stale_in_a_row_ >= kStaleMax)
    return Result<Frame>(lost("the camera keeps sending frames from before the trigger"));
  if (!taken) return Result<Frame>(tl::unexpected(taken.error()));
  if (!*taken) return std::nullopt;
  longest_wait_ = std::max(longest_wait_, steady_clock::now() - asked);
  frames_missed_ = 0;
  return Result<Frame>(std::move(**taken));
}

tl::unexpected<Error> FrameCapture::missed(MonotonicTime deadline) {
  if (options_.trigger == AravisTrigger::kSoftware && !events_.trigger_answered())
    return lost("the camera does not answer a trigger");
  frames_due_ = 0;
  ++frames_missed_;
  // Without the device's clock, a late frame would be taken for the next one.
  const bool enough = frames_missed_ >= options_.missed_frames_max || goes_by_arrival();
  if (options_.trigger != AravisTrigger::kLine && enough) return lost("the camera answers but sends no frames");
  if (steady_clock::now() >= deadline) return late();
  return fail_here(ErrorCode::kFrameDropped, "no frame arrived within " + std::to_string(options_.frame_timeout_ms) +
                                                 " ms: it was lost, or frame_timeout_ms is too short");
}

tl::unexpected<Error> FrameCapture::late() const {
  if (passed_over_ == 0) return fail_here(ErrorCode::kFrameLate, "no frame arrived before the deadline");
  if (!goes_by_arrival())
    return fail_here(ErrorCode::kFrameLate, "only frames from before the trigger arrived in time");
  return fail_here(ErrorCode::kFrameLate,
                   "only frames arrived that may be older than the trigger; set readout_us to the longest time from "
                   "the end of an exposure to its frame's arrival");
}

tl::unexpected<Error> FrameCapture::lost(const std::string& reason) const {
  return fail_here(ErrorCode::kDisconnected, reason + "; check power, cable and network of " + device_name_);
}

tl::unexpected<Error> FrameCapture::fail_here(ErrorCode code, std::string message) const {
  return fail(code, std::move(message), options_.name);
}

}  // namespace slsd
