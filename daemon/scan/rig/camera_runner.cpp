// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/rig/camera_runner.hpp"

#include <spdlog/spdlog.h>

#include <utility>

#include "daemon/scan/message_ids.hpp"
#include "daemon/scan/within_memory.hpp"
#include "drivers/camera/file_camera.hpp"
#include "drivers/log/log_field.hpp"
#include "drivers/system/thread_name.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

constexpr auto kLookPeriod = 200ms;
constexpr auto kPromise = 3s;  // for a step that is quick
constexpr auto kPausePromise = 10s;
constexpr auto kExposurePromise = 30s;  // a lost device answers late

}  // namespace

CameraRunner::CameraRunner(std::unique_ptr<Camera> camera, const ScanOptions& options, std::vector<double> exposures_us)
    : name_(camera->description().name),
      exposures_us_(std::move(exposures_us)),
      replays_(camera->description().driver == FileCameraOptions::kDriver),
      backoff_(options),
      camera_(std::move(camera)) {
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

Result<> CameraRunner::wait_ready(const WaitLimit& limit) {
  std::unique_lock lock(mutex_);
  const auto decided = [this] { return stopped_ || status_.state == DeviceState::kReady; };
  const bool ready = limit.wait_until(limit.deadline, changed_, lock, decided) && !stopped_;
  if (ready) return {};
  if (stopped_) return fail(ErrorCode::kCancelled, "the service is stopping");
  if (limit.over.stop_requested()) return fail(ErrorCode::kCancelled, "cancelled: the client disconnected");
  return fail_not_ready();
}

tl::unexpected<Error> CameraRunner::fail_not_ready() const {
  const std::string reason = status_.problem.empty() ? "it is still opening" : status_.problem;
  return fail(ErrorCode::kTimeout, "the camera did not become ready in time: " + reason, "camera " + name_);
}

void CameraRunner::begin_capture(MonotonicTime deadline, Exposure exposure, Picture light, std::size_t round) {
  {
    const std::lock_guard lock(mutex_);
    answer_.reset();
    order_ = Order{deadline, exposure, light, round};
  }
  changed_.notify_all();
}

bool CameraRunner::wait_captured(const WaitLimit& limit, MonotonicTime until) {
  std::unique_lock lock(mutex_);
  return limit.wait_until(until, changed_, lock, [this] { return stopped_ || answer_.has_value(); });
}

void CameraRunner::cancel_capture() {
  const std::lock_guard lock(mutex_);
  if (!order_ || answer_) return;
  order_->cancelled = true;
  if (status_.state == DeviceState::kCapturing) cancel();
}

Result<Frame> CameraRunner::end_capture() {
  std::unique_lock lock(mutex_);
  order_.reset();
  if (answer_) {
    Result<Frame> frame = std::move(*answer_);
    answer_.reset();
    if (!frame && (frame.error().where.empty() || frame.error().where == name_)) {
      frame.error().where = "camera " + name_;
    }
    return frame;
  }
  if (stopped_) return fail(ErrorCode::kCancelled, "the service is stopping", "camera " + name_);
  if (status_.state != DeviceState::kCapturing) return fail_not_ready();
  given_up_ = true;
  const LogField about("SLSD_CAMERA", name_);  // the caller may be another thread
  const Error error{ErrorCode::kDisconnected,
                    "the camera's driver does not answer; slsd reopens the camera when it does", "camera " + name_};
  note_lost(error, std::move(lock));
  return tl::unexpected(error);
}

void CameraRunner::run(const std::stop_token& stop) {
  name_this_thread("cam " + name_);
  const LogField about("SLSD_CAMERA", name_);
  while (!stop.stop_requested()) {
    if (auto replacement = take_replacement()) {
      exchange(std::move(*replacement));
    } else if (!is_open(status().state)) {
      open_or_pause(stop);
    } else if (const auto order = next_order(stop)) {
      take_frame(*order);
    } else if (!stop.stop_requested()) {
      look_after();
    }
  }
  close();
}

Result<> CameraRunner::replace(std::unique_ptr<Camera> next, std::unique_ptr<Camera> otherwise,
                               MonotonicTime deadline) {
  std::unique_lock lock(mutex_);
  replaced_.reset();
  replacement_.emplace(Replacement{std::move(next), std::move(otherwise)});
  ++replacements_;
  changed_.notify_all();
  changed_.wait_until(lock, deadline, [this] { return stopped_ || replaced_.has_value(); });
  if (replaced_) return *replaced_;
  replacement_.reset();  // if it has not begun; else its result is dropped
  ++replacements_;
  if (stopped_) return fail(ErrorCode::kCancelled, "the service is stopping", "camera " + name_);
  return fail(ErrorCode::kTimeout, "the camera did not take the new settings in time: check slsctl status",
              "camera " + name_);
}

std::optional<CameraRunner::Replacement> CameraRunner::take_replacement() {
  const std::lock_guard lock(mutex_);
  if (replacement_) replacement_->number = replacements_;
  return std::exchange(replacement_, std::nullopt);
}

void CameraRunner::exchange(Replacement replacement) {
  const bool was_open = is_open(status().state);
  const auto open = [this](std::unique_ptr<Camera> camera) {
    heartbeat_.promise(kPausePromise + camera->open_time_max());
    put(std::move(camera));
    return open_camera();
  };
  Result<> opened = open(std::move(replacement.next));
  Result<> outcome;
  if (!opened && was_open) {
    outcome = opened;
    outcome.error().where = "camera " + name_ + (opened.error().where.empty() ? "" : ", " + opened.error().where);
  }
  {
    const std::lock_guard lock(mutex_);
    const bool awaited = replacement.number == replacements_;
    if (!awaited) outcome = fail(ErrorCode::kTimeout, "the request ended before the camera took its settings");
    if (outcome) replaced_ = Result<>();  // from here on no caller abandons it
  }
  if (!outcome) opened = open(std::move(replacement.otherwise));
  heartbeat_.promise(kPromise);
  note_opened(opened);
  const std::lock_guard lock(mutex_);
  if (!outcome && replacement.number == replacements_) replaced_ = std::move(outcome);
  changed_.notify_all();
}

// One camera at a time owns the device: the old one ends first.
void CameraRunner::put(std::unique_ptr<Camera> camera) {
  camera->set_found([this] { note_found(); });
  std::unique_ptr<Camera> before;
  {
    const std::lock_guard lock(mutex_);
    status_.state = DeviceState::kOpening;
    before = std::move(camera_);
  }
  before.reset();
  const std::lock_guard lock(mutex_);
  camera_ = std::move(camera);
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

Result<> CameraRunner::open_camera() {
  Result<> opened;
  within_memory([&] { opened = camera_->open(); }, [&] { opened = tl::unexpected(out_of_memory()); });
  return opened;
}

void CameraRunner::open_or_pause(const std::stop_token& stop) {
  heartbeat_.promise(camera_->open_time_max());
  {
    const std::lock_guard lock(mutex_);
    if (status_.state != DeviceState::kAbsent) status_.state = DeviceState::kOpening;
  }
  const Result<> opened = open_camera();
  heartbeat_.promise(kPromise);
  if (!opened && opened.error().code == ErrorCode::kCancelled) return;
  note_opened(opened);
  if (opened) return backoff_.reset();
  const auto pause = backoff_.next();
  heartbeat_.promise(pause + kPausePromise);
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, stop, pause, [] { return false; });
}

// If nothing answers, the camera stays absent, however often the search repeats.
void CameraRunner::note_found() {
  const std::lock_guard lock(mutex_);
  status_.state = DeviceState::kOpening;
}

void CameraRunner::note_opened(const Result<>& opened) {
  std::unique_lock lock(mutex_);
  const bool had_problem = !status_.problem.empty();
  if (!opened) {
    const std::string problem = to_string(opened.error());
    status_.state = state_after(opened.error().code);
    status_.problem = problem;
    lock.unlock();
    const LogField code("SLSD_ERROR", std::string(to_string(opened.error().code)));
    const MessageId id(MessageId::kDeviceLost);
    if (!had_problem) spdlog::warn("camera {}: {}; trying again until it opens", name_, problem);
    return;
  }
  const CameraDescription& description = camera_->description();
  status_.device = description.device;
  status_.hardware = description.hardware;
  status_.width_px = description.width_px;
  status_.height_px = description.height_px;
  rate_hz_ = description.rate_hz;
  gaps_.restart();
  status_.problem.clear();
  status_.state = DeviceState::kReady;
  ++status_.opened;
  lock.unlock();
  changed_.notify_all();
  if (!had_problem) return;
  const MessageId id(MessageId::kDeviceBack);
  spdlog::info("camera {}: open again", name_);
}

std::optional<CameraRunner::Order> CameraRunner::next_order(const std::stop_token& stop) {
  heartbeat_.promise(kPromise);
  std::unique_lock lock(mutex_);
  const auto waiting = [this] { return order_.has_value() && !answer_.has_value(); };
  const auto asked = [&] { return waiting() || replacement_.has_value(); };
  if (!changed_.wait_for(lock, stop, kLookPeriod, asked) || !waiting()) return std::nullopt;
  status_.state = DeviceState::kCapturing;
  return order_;
}

void CameraRunner::look_after() {
  const Result<> there = camera_->check();
  note_figures(std::unique_lock(mutex_));
  if (!there) note_lost(there.error(), std::unique_lock(mutex_));
}

void CameraRunner::note_figures(const std::unique_lock<std::mutex>&) {
  status_.figures.clear();
  camera_->tell_figures(status_.figures);
}

void CameraRunner::note_lost(const Error& error, std::unique_lock<std::mutex> lock) {
  status_.state = DeviceState::kFaulted;
  status_.problem = error.message;
  lock.unlock();
  const LogField code("SLSD_ERROR", std::string(to_string(error.code)));
  const MessageId id(MessageId::kDeviceLost);
  spdlog::warn("camera {}: {}; trying again until it opens", name_, error.message);
}

Result<> CameraRunner::set_exposure(const Order& order) {
  if (exposures_us_.empty()) return {};
  heartbeat_.promise(kExposurePromise);
  return camera_->set_exposure(exposures_us_[order.round]);
}

void CameraRunner::take_frame(const Order& order) {
  camera_->expect(order.light);
  if (auto set = set_exposure(order); !set) return note_frame(tl::unexpected(set.error()));
  for (;;) {
    const auto longest = camera_->frame_time_max();
    heartbeat_.promise(longest + kPromise);
    const MonotonicTime end = std::min<MonotonicTime>(order.deadline, steady_clock::now() + longest);
    Result<Frame> frame = fail(ErrorCode::kCancelled, "");
    within_memory(
        [&] { frame = order.exposure == Exposure::kNext ? camera_->capture_next(end) : camera_->capture(end); },
        [&] { frame = tl::unexpected(out_of_memory()); });
    if (frame || !goes_on(order, frame.error())) return note_frame(std::move(frame));
  }
}

// A cancel() that comes as a capture ends would end the next one by mistake. And a line that was silent for a frame's
// longest time has lost no frame. So only ask the driver again; that also detects one that hangs.
bool CameraRunner::goes_on(const Order& order, const Error& error) const {
  if (steady_clock::now() >= order.deadline) return false;
  const std::lock_guard lock(mutex_);
  if (stopped_ || !order_ || order_->cancelled || given_up_) return false;
  if (error.code == ErrorCode::kCancelled) return true;
  const bool nothing_came = error.code == ErrorCode::kFrameDropped || error.code == ErrorCode::kFrameLate;
  return nothing_came && camera_->description().external_trigger;
}

void CameraRunner::note_frame(Result<Frame> frame) {
  std::unique_lock lock(mutex_);
  if (std::exchange(given_up_, false)) return;
  status_.state = DeviceState::kReady;
  note_figures(lock);
  if (frame) {
    ++status_.frames;
    status_.frames_lost += gaps_.note_frame(frame->sequence());
  } else if (frame.error().code != ErrorCode::kBusy && frame.error().code != ErrorCode::kCancelled) {
    ++status_.frames_lost;
    ++status_.frames_failed[frame.error().code];
    gaps_.note_failure();
  }
  const bool lost = !frame && frame.error().code == ErrorCode::kDisconnected;
  const Error error = lost ? frame.error() : Error{};
  if (order_) answer_.emplace(std::move(frame));
  changed_.notify_all();
  if (lost) note_lost(error, std::move(lock));
}

}  // namespace slsd
