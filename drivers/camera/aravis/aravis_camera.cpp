// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/aravis_camera.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include <spdlog/spdlog.h>

#include "drivers/camera/aravis/aravis_camera_options.hpp"
#include "drivers/camera/aravis/aravis_session.hpp"
#include "drivers/camera/aravis/frames/capture_events.hpp"

namespace slsd {
namespace {

constexpr std::size_t kClosingMax = 4;

}  // namespace

AravisCamera::AravisCamera(AravisCameraOptions options)
    : options_(std::move(options)),
      description_{options_.name, "aravis", options_.id, 0, 0, 0.0, {}},
      events_(std::make_unique<CaptureEvents>()) {}

AravisCamera::~AravisCamera() {
  end_session();
  closing_.clear();
}

Result<> AravisCamera::open() {
  end_session();
  if (auto valid = options_.validate(); !valid) return valid;
  auto session = AravisSession::open(options_, address_, *events_, found_);
  if (!session) return tl::unexpected(session.error());
  session_ = std::move(*session);
  exposure_changed_ = false;
  address_ = session_->address();
  description_.device = session_->name();
  description_.hardware = session_->name();
  description_.width_px = session_->layout().width_px;
  description_.height_px = session_->layout().height_px;
  description_.rate_hz = options_.trigger == AravisTrigger::kFreeRun ? options_.rate_hz : 0.0;
  description_.external_trigger = options_.trigger == AravisTrigger::kLine;
  log_warnings();
  return {};
}

// A busy device may answer many queries late before the first frame is requested.
std::chrono::nanoseconds AravisCamera::open_time_max() const {
  return Camera::open_time_max() + first_frame_time_max(options_);
}

std::chrono::nanoseconds AravisCamera::frame_time_max() const {
  return Camera::frame_time_max() + from_us(options_.exposure_us + options_.readout_us);
}

void AravisCamera::log_warnings() {
  for (const NetworkWarning& warning : session_->warnings()) {
    if (std::ranges::find(logged_, warning.name) != logged_.end()) continue;
    logged_.push_back(warning.name);
    spdlog::warn("camera {}: {}: {}", options_.name, warning.name, warning.advice);
  }
}

// A device that answers must be released before it can be opened again. Nobody waits for one that does not answer.
void AravisCamera::end_session() {
  last_start_.reset();
  if (!session_) return;
  ended_ = session_->statistics();
  if (session_->answers()) return session_.reset();
  session_->abandon();
  if (closing_.size() >= kClosingMax) closing_.erase(closing_.begin());
  closing_.emplace_back([dying = std::move(session_)]() mutable { dying.reset(); });
}

Result<> AravisCamera::set_exposure(double exposure_us) {
  if (!session_) return fail(ErrorCode::kDisconnected, "the camera is not open; open it", options_.name);
  if (options_.exposure_us == exposure_us) return {};
  auto set = session_->set_exposure(exposure_us);
  if (set) {
    options_.exposure_us = exposure_us;
    exposure_changed_ = options_.trigger == AravisTrigger::kFreeRun;
  } else if (set.error().code == ErrorCode::kDisconnected) {
    end_session();
  }
  return set;
}

Result<> AravisCamera::pass_over(MonotonicTime deadline) {
  if (!exposure_changed_) return {};
  const auto passed = note(session_->capture(deadline));
  if (!passed && passed.error().code != ErrorCode::kMismatch) return tl::unexpected(passed.error());
  exposure_changed_ = false;
  return {};
}

Result<Frame> AravisCamera::capture(MonotonicTime deadline) {
  if (!session_) return fail(ErrorCode::kDisconnected, "the camera is not open; open it", options_.name);
  if (auto passed = pass_over(deadline); !passed) return tl::unexpected(passed.error());
  return note(session_->capture(deadline));
}

void AravisCamera::expect(Picture light) {
  if (session_) session_->expect(light);
}

Result<Frame> AravisCamera::capture_next(MonotonicTime deadline) {
  if (options_.trigger != AravisTrigger::kFreeRun || !last_start_) return capture(deadline);
  return note(session_->capture_since(*last_start_ + std::chrono::nanoseconds(1), deadline));
}

Result<Frame> AravisCamera::note(Result<Frame> frame) {
  const bool clock = session_->note_clock();
  const bool fragments = !frame && session_->note_fragments();
  if (clock || fragments) log_warnings();
  if (frame) last_start_ = frame->exposure_start();
  if (!frame && frame.error().code == ErrorCode::kDisconnected) end_session();
  return frame;
}

Result<> AravisCamera::check() {
  if (!session_) return fail(ErrorCode::kDisconnected, "the camera is not open; open it", options_.name);
  auto there = session_->check();
  if (!there) end_session();
  return there;
}

void AravisCamera::cancel() {
  events_->cancel();
}

void AravisCamera::tell_figures(std::vector<DriverFigure>& figures) const {
  const AravisStatistics counted = statistics();
  const auto tell = [&](std::string_view name, std::uint64_t count) {
    figures.push_back({name, static_cast<double>(count)});
  };
  tell("frames_missing", counted.lost);
  tell("frames_torn", counted.torn);
  tell("frames_stale", counted.stale);
  tell("frames_misexposed", counted.misexposed);
  tell("packets_sent_again", counted.packets_sent_again);
  tell("packets_missing", counted.packets_missing);
  tell("underruns", counted.underruns);
  figures.push_back({"clock_drift_ppm", clock_drift_ppm(), false});
}

AravisStatistics AravisCamera::statistics() const {
  return session_ ? session_->statistics() : ended_;
}

double AravisCamera::clock_drift_ppm() const {
  return session_ ? session_->clock().drift_ppm() : 0.0;
}

std::vector<std::string> AravisCamera::warnings() const {
  std::vector<std::string> names;
  if (!session_) return names;
  for (const NetworkWarning& warning : session_->warnings()) names.push_back(warning.name);
  return names;
}

}  // namespace slsd
