// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/camera_runner.hpp"

#include <spdlog/spdlog.h>

#include "daemon/scan/thread_name.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;

// A driver answers by its deadline; one that does not is told to, and the watchdog deals with one that is stuck.
constexpr auto kGrace = 500ms;

}  // namespace

CameraRunner::CameraRunner(std::unique_ptr<Camera> camera, const ScanOptions& options)
    : camera_(std::move(camera)), backoff_(options) {
  const CameraDescription& description = camera_->description();
  status_.name = description.name;
  status_.driver = description.driver;
  status_.device = description.device;
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

CameraRunner::~CameraRunner() {
  request_stop();
}

void CameraRunner::request_stop() {
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
  }
  thread_.request_stop();
  camera_->cancel();
  changed_.notify_all();
}

DeviceStatus CameraRunner::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

Result<> CameraRunner::wait_ready(MonotonicTime deadline) {
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, deadline, [this] { return stopped_ || status_.state == DeviceState::kReady; });
  if (stopped_) return fail(ErrorCode::kCancelled, "the service is stopping");
  if (status_.state == DeviceState::kReady) return {};
  const std::string reason = status_.problem.empty() ? "it is still opening" : status_.problem;
  return fail(ErrorCode::kTimeout, "the camera did not become ready in time: " + reason, "camera " + status_.name);
}

void CameraRunner::begin_capture(MonotonicTime deadline) {
  {
    const std::lock_guard lock(mutex_);
    answer_.reset();
    asked_ = deadline;
  }
  changed_.notify_all();
}

Result<Frame> CameraRunner::end_capture() {
  std::unique_lock lock(mutex_);
  const auto answered = [this] { return stopped_ || answer_.has_value(); };
  if (asked_ && !changed_.wait_until(lock, *asked_ + kGrace, answered)) camera_->cancel();
  changed_.wait(lock, answered);
  asked_.reset();
  if (!answer_) return fail(ErrorCode::kCancelled, "the service is stopping", "camera " + status_.name);
  Result<Frame> frame = std::move(*answer_);
  answer_.reset();
  if (!frame && (frame.error().where.empty() || frame.error().where == status_.name)) {
    frame.error().where = "camera " + status_.name;
  }
  return frame;
}

void CameraRunner::run(const std::stop_token& stop) {
  name_this_thread("cam " + status_.name);
  while (!stop.stop_requested()) {
    if (status().state != DeviceState::kReady) {
      open_or_pause(stop);
    } else if (const auto deadline = next_capture(stop)) {
      note_frame(camera_->capture(*deadline));
    }
  }
}

void CameraRunner::open_or_pause(const std::stop_token& stop) {
  const Result<> opened = camera_->open();
  note_opened(opened);
  if (opened) return backoff_.reset();
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, stop, backoff_.next(), [] { return false; });
}

void CameraRunner::note_opened(const Result<>& opened) {
  const std::lock_guard lock(mutex_);
  if (!opened) {
    const std::string problem = to_string(opened.error());
    if (status_.problem.empty()) spdlog::warn("camera {}: {}; trying again until it opens", status_.name, problem);
    status_.state = DeviceState::kFailed;
    status_.problem = problem;
    return;
  }
  const CameraDescription& description = camera_->description();
  status_.device = description.device;
  status_.width_px = description.width_px;
  status_.height_px = description.height_px;
  if (!status_.problem.empty()) spdlog::info("camera {}: open again", status_.name);
  status_.problem.clear();
  status_.state = DeviceState::kReady;
  ++status_.opened;
  changed_.notify_all();
}

std::optional<MonotonicTime> CameraRunner::next_capture(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  const auto waiting = [this] { return asked_.has_value() && !answer_.has_value(); };
  if (!changed_.wait(lock, stop, waiting)) return std::nullopt;
  return asked_;
}

void CameraRunner::note_frame(Result<Frame> frame) {
  const std::lock_guard lock(mutex_);
  if (frame) {
    ++status_.frames;
  } else {
    ++status_.frames_lost;
  }
  if (!frame && frame.error().code == ErrorCode::kDisconnected) {
    status_.state = DeviceState::kFailed;
    status_.problem = frame.error().message;
    spdlog::warn("camera {}: {}; trying again until it opens", status_.name, status_.problem);
  }
  answer_.emplace(std::move(frame));
  changed_.notify_all();
}

}  // namespace slsd
