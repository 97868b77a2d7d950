// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/camera_runner.hpp"

#include <spdlog/spdlog.h>

#include <utility>

#include "daemon/scan/hardware.hpp"
#include "daemon/scan/thread_name.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

// A driver answers by its deadline; one that does not is told to, and then left alone.
constexpr auto kGrace = 500ms;
constexpr auto kLookPeriod = 200ms;
constexpr auto kPromise = 10s;

}  // namespace

CameraRunner::CameraRunner(std::unique_ptr<Camera> camera, const ScanOptions& options)
    : name_(camera->description().name), backoff_(options), camera_(std::move(camera)) {
  const CameraDescription& description = camera_->description();
  status_.name = description.name;
  status_.driver = description.driver;
  status_.device = description.device;
  camera_->set_found([this] { note_found(); });
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

CameraRunner::~CameraRunner() {
  request_stop();
}

void CameraRunner::request_stop() {
  thread_.request_stop();
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
    cancel();
  }
  changed_.notify_all();
}

void CameraRunner::cancel() {
  if (camera_) camera_->cancel();
}

DeviceStatus CameraRunner::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

std::uint64_t CameraRunner::openings() const {
  const std::lock_guard lock(mutex_);
  return status_.opened;
}

Result<> CameraRunner::wait_ready(MonotonicTime deadline) {
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, deadline, [this] { return stopped_ || status_.state == DeviceState::kReady; });
  if (stopped_) return fail(ErrorCode::kCancelled, "the service is stopping");
  if (status_.state == DeviceState::kReady) return {};
  return fail_not_ready();
}

tl::unexpected<Error> CameraRunner::fail_not_ready() const {
  const std::string reason = status_.problem.empty() ? "it is still opening" : status_.problem;
  return fail(ErrorCode::kTimeout, "the camera did not become ready in time: " + reason, "camera " + name_);
}

void CameraRunner::begin_capture(MonotonicTime deadline, Exposure exposure, FrameLight light) {
  {
    const std::lock_guard lock(mutex_);
    answer_.reset();
    order_ = Order{deadline, exposure, light};
  }
  changed_.notify_all();
}

Result<Frame> CameraRunner::end_capture() {
  std::unique_lock lock(mutex_);
  const auto answered = [this] { return stopped_ || answer_.has_value(); };
  if (order_ && !changed_.wait_until(lock, order_->deadline + kGrace, answered)) {
    if (status_.state != DeviceState::kCapturing) return order_.reset(), fail_not_ready();
    cancel();
    if (!changed_.wait_for(lock, kGrace, answered)) return give_up();
  }
  order_.reset();
  if (!answer_) return fail(ErrorCode::kCancelled, "the service is stopping", "camera " + name_);
  Result<Frame> frame = std::move(*answer_);
  answer_.reset();
  if (!frame && (frame.error().where.empty() || frame.error().where == name_)) {
    frame.error().where = "camera " + name_;
  }
  return frame;
}

tl::unexpected<Error> CameraRunner::give_up() {
  given_up_ = true;
  order_.reset();
  const Error error{ErrorCode::kDisconnected, "the camera's driver does not answer; it is opened again when it does",
                    "camera " + name_};
  note_lost(error);
  return tl::unexpected(error);
}

void CameraRunner::run(const std::stop_token& stop) {
  name_this_thread("cam " + name_);
  while (!stop.stop_requested()) {
    if (!is_open(status().state)) {
      open_or_pause(stop);
    } else if (const auto order = next_order(stop)) {
      take_frame(*order);
    } else if (!stop.stop_requested()) {
      look_after();
    }
  }
  close();
}

void CameraRunner::close() {
  std::unique_ptr<Camera> camera;
  {
    const std::lock_guard lock(mutex_);
    camera = std::move(camera_);
  }
  camera.reset();
  ended_ = true;
}

void CameraRunner::open_or_pause(const std::stop_token& stop) {
  heartbeat_.promise(camera_->open_time_max());
  {
    const std::lock_guard lock(mutex_);
    if (status_.state != DeviceState::kAbsent) status_.state = DeviceState::kOpening;
  }
  const Result<> opened = camera_->open();
  heartbeat_.promise(kPromise);
  if (!opened && opened.error().code == ErrorCode::kCancelled) return;
  note_opened(opened);
  if (opened) return backoff_.reset();
  const auto pause = backoff_.next();
  heartbeat_.promise(pause + kPromise);
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, stop, pause, [] { return false; });
}

// While nothing answers the camera stays absent, however often it is looked for.
void CameraRunner::note_found() {
  const std::lock_guard lock(mutex_);
  status_.state = DeviceState::kOpening;
}

void CameraRunner::note_opened(const Result<>& opened) {
  const std::lock_guard lock(mutex_);
  if (!opened) {
    const std::string problem = to_string(opened.error());
    if (status_.problem.empty()) spdlog::warn("camera {}: {}; trying again until it opens", name_, problem);
    status_.state = state_after(opened.error().code);
    status_.problem = problem;
    return;
  }
  const CameraDescription& description = camera_->description();
  status_.device = description.device;
  status_.hardware = description.hardware;
  status_.width_px = description.width_px;
  status_.height_px = description.height_px;
  rate_hz_ = description.rate_hz;
  gaps_.restart();
  if (!status_.problem.empty()) spdlog::info("camera {}: open again", name_);
  status_.problem.clear();
  status_.state = DeviceState::kReady;
  ++status_.opened;
  changed_.notify_all();
}

std::optional<CameraRunner::Order> CameraRunner::next_order(const std::stop_token& stop) {
  heartbeat_.promise(kPromise);
  std::unique_lock lock(mutex_);
  const auto waiting = [this] { return order_.has_value() && !answer_.has_value(); };
  if (!changed_.wait_for(lock, stop, kLookPeriod, waiting)) return std::nullopt;
  status_.state = DeviceState::kCapturing;
  return order_;
}

void CameraRunner::look_after() {
  const Result<> there = camera_->check();
  if (there) return;
  const std::lock_guard lock(mutex_);
  note_lost(there.error());
}

void CameraRunner::note_lost(const Error& error) {
  status_.state = DeviceState::kFaulted;
  status_.problem = error.message;
  spdlog::warn("camera {}: {}; trying again until it opens", name_, status_.problem);
}

void CameraRunner::take_frame(const Order& order) {
  heartbeat_.promise(order.deadline - steady_clock::now() + kPromise);
  camera_->expect(order.light);
  note_frame(order.exposure == Exposure::kNext ? camera_->capture_next(order.deadline)
                                               : camera_->capture(order.deadline));
}

void CameraRunner::note_frame(Result<Frame> frame) {
  const std::lock_guard lock(mutex_);
  if (std::exchange(given_up_, false)) return;
  status_.state = DeviceState::kReady;
  if (frame) {
    ++status_.frames;
    status_.frames_lost += gaps_.note_frame(frame->sequence());
  } else if (frame.error().code != ErrorCode::kBusy && frame.error().code != ErrorCode::kCancelled) {
    ++status_.frames_lost;
    gaps_.note_failure();
  }
  if (!frame && frame.error().code == ErrorCode::kDisconnected) note_lost(frame.error());
  answer_.emplace(std::move(frame));
  changed_.notify_all();
}

}  // namespace slsd
