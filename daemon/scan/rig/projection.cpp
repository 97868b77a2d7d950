// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/rig/projection.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <condition_variable>
#include <utility>

#include "daemon/scan/message_ids.hpp"
#include "daemon/scan/rig/hardware.hpp"
#include "drivers/log/log_field.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

constexpr auto kSlice = 100ms;  // interval at which a wait for the projector checks whether to go on
constexpr auto kGrace = 300ms;  // past a scan's deadline

void sleep_until(MonotonicTime time, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock lock(mutex);
  never.wait_until(lock, stop, time, [] { return false; });
}

}  // namespace

Projection::Projection(std::unique_ptr<Projector> projector, Grey8 pattern, const ScanOptions& options)
    : projector_(std::move(projector)),
      pattern_(std::move(pattern)),
      latency_(options.projector_latency()),
      backoff_(options) {
  const ProjectorDescription& description = projector_->description();
  status_.name = "projector";
  status_.driver = description.driver;
  status_.device = description.monitor;
  status_.width_px = description.width_px;
  status_.height_px = description.height_px;
}

DeviceStatus Projection::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

void Projection::set_pattern(Grey8 pattern) {
  pattern_ = std::move(pattern);
  if (shown_ == Picture::kPattern || held_) shown_.reset();
}

void Projection::set_idle(std::optional<Grey8> picture, std::chrono::milliseconds after) {
  idle_ = std::move(picture);
  idle_after_ = after;
  if (shown_ == Picture::kIdle) shown_.reset();
}

void Projection::set_held(std::optional<Held> held) {
  if (!held) last_scan_ = {};
  held_ = std::move(held);
  if (shown_ == Picture::kHeld) shown_.reset();
}

Picture Projection::due() const {
  if (held_) return Picture::kHeld;
  return idle_ && steady_clock::now() - last_scan_ >= idle_after_ ? Picture::kIdle : Picture::kPattern;
}

MonotonicTime Projection::next_change() const {
  if (!shown_ || looking_) return next_attempt_;
  const bool idle_comes = idle_ && !held_ && shown_ != Picture::kIdle;
  return idle_comes ? last_scan_ + idle_after_ : MonotonicTime::max();
}

const Grey8& Projection::image(Picture which) {
  if (which == Picture::kIdle) return *idle_;
  if (which == Picture::kHeld && held_->picture) return *held_->picture;
  if (which != Picture::kWhite && which != Picture::kBlack) return pattern_;
  if (plain_.empty()) plain_ = Grey8(pattern_.width(), pattern_.height());
  std::fill_n(plain_.data(), plain_.size(), which == Picture::kWhite ? 255 : 0);
  return plain_;
}

Result<> Projection::open_and_show(Picture which, MonotonicTime until) {
  if (!open_) {
    if (auto opened = projector_->open(until); !opened) return opened;
    open_ = true;
  }
  const auto complete = projector_->show(image(which), until);
  if (!complete) return tl::unexpected(complete.error());
  visible_ = *complete + latency_;
  ++changes_;
  return {};
}

void Projection::attempt(Picture which, MonotonicTime until) {
  if (shown_ == which || steady_clock::now() < next_attempt_) return;
  const Result<> outcome = open_and_show(which, until);
  shown_.reset();
  if (!outcome && outcome.error().code == ErrorCode::kTimeout) return;  // the task continues
  if (outcome) shown_ = which;
  open_ = outcome.has_value();
  note(outcome);
  if (outcome) {
    backoff_.reset();
  } else {
    next_attempt_ = steady_clock::now() + backoff_.next();
  }
}

// Tells whether the projector answers by then. If it no longer shows the picture, notes the loss.
bool Projection::look(MonotonicTime until) {
  const auto there = shown_ ? projector_->check(until) : Result<>();
  looking_ = !there && there.error().code == ErrorCode::kTimeout;
  if (!there && !looking_) lose(there);
  return !looking_;
}

void Projection::lose(const Result<>& reason) {
  shown_.reset();
  open_ = false;
  note(reason);
}

void Projection::supervise() {
  const MonotonicTime until = steady_clock::now() + kSlice;
  if (look(until)) attempt(due(), until);
}

Result<> Projection::check(MonotonicTime deadline) {
  auto there = projector_->check(std::max<MonotonicTime>(deadline, steady_clock::now()) + kGrace);
  if (there) return there;
  if (there.error().code != ErrorCode::kTimeout) lose(there);
  Error error = std::move(there.error());
  error.code = ErrorCode::kDisconnected;
  if (error.where != "projector") error.where = "projector, " + error.where;
  return tl::unexpected(std::move(error));
}

void Projection::note(const Result<>& outcome) {
  const std::lock_guard lock(mutex_);
  const LogField about("SLSD_PROJECTOR", status_.device.empty() ? status_.driver : status_.device);
  status_.shows = shown_ ? to_string(*shown_) : "";
  if (!outcome) {
    const LogField code("SLSD_ERROR", std::string(to_string(outcome.error().code)));
    const MessageId id(MessageId::kDeviceLost);
    if (status_.problem.empty()) spdlog::warn("projector: {}; trying again until it opens", to_string(outcome.error()));
    status_.state = state_after(outcome.error().code);
    status_.problem = to_string(outcome.error());
    return;
  }
  if (!status_.problem.empty()) {
    const MessageId id(MessageId::kDeviceBack);
    spdlog::info("projector: open again");
  }
  if (!is_open(status_.state)) {
    ++status_.opened;
    const ProjectorDescription& description = projector_->description();
    status_.device = description.monitor;
    status_.hardware = projector_hardware(description.model, description.serial);
    for (const std::string& warning : projector_->warnings()) spdlog::warn("projector {}: {}", status_.device, warning);
  }
  status_.state = DeviceState::kReady;
  status_.problem.clear();
}

Result<> Projection::await(Picture which, MonotonicTime deadline, const std::stop_token& stop) {
  for (bool looked = false; !looked || shown_ != which;) {
    const MonotonicTime until = std::min<MonotonicTime>(deadline, steady_clock::now() + kSlice);
    looked = looked || look(until);
    if (looked) attempt(which, until);
    if (stop.stop_requested()) return fail(ErrorCode::kCancelled, "the service is stopping");
    if (looked && shown_ == which) break;
    if (steady_clock::now() >= deadline) return fail_not_ready();
    sleep_until(std::min(deadline, next_attempt_), stop);
  }
  if (visible_ > deadline)
    return fail(ErrorCode::kTimeout, "the projector did not show the picture in time: allow a longer timeout",
                "projector");
  sleep_until(visible_, stop);
  if (stop.stop_requested()) return fail(ErrorCode::kCancelled, "the service is stopping");
  return {};
}

tl::unexpected<Error> Projection::fail_not_ready() const {
  const std::string problem = status().problem;
  return fail(ErrorCode::kTimeout,
              "the projector did not become ready in time: " + (problem.empty() ? "it is still opening" : problem),
              "projector");
}

Result<> Projection::show(Picture picture, MonotonicTime deadline, const std::stop_token& stop) {
  set_held(std::nullopt);
  auto shown = await(picture, deadline, stop);
  last_scan_ = steady_clock::now();
  return shown;
}

Result<> Projection::hold(std::optional<Grey8> picture, MonotonicTime deadline, const std::stop_token& stop) {
  return show_held(Held{std::move(picture)}, deadline, stop);
}

Result<> Projection::release(MonotonicTime deadline, const std::stop_token& stop) {
  return show_held(std::nullopt, deadline, stop);
}

Result<> Projection::show_held(std::optional<Held> held, MonotonicTime deadline, const std::stop_token& stop) {
  std::optional<Held> before = held_;
  set_held(std::move(held));
  auto shown = show_due(deadline, stop);
  if (!shown) set_held(std::move(before));
  return shown;
}

Result<> Projection::show_due(MonotonicTime deadline, const std::stop_token& stop) {
  return await(due(), deadline, stop);
}

}  // namespace slsd
