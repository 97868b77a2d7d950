// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/frames/capture_events.hpp"

#include <chrono>
#include <utility>

namespace slsd {
namespace {

using std::chrono::steady_clock;

struct Reporter {
  CaptureEvents& events;
  std::uint64_t session;
};

void free_reporter(void* reporter) {
  delete static_cast<Reporter*>(reporter);
}

void free_signal_reporter(void* reporter, GClosure*) {
  free_reporter(reporter);
}

// Runs on the stream's thread. Aravis stamps with CLOCK_REALTIME, which may jump.
void note_stream(void* user, ArvStreamCallbackType type, ArvBuffer* buffer) {
  if (type != ARV_STREAM_CALLBACK_TYPE_BUFFER_DONE || buffer == nullptr) return;
  const Reporter& reporter = *static_cast<Reporter*>(user);
  arv_buffer_set_system_timestamp(buffer, static_cast<guint64>(steady_clock::now().time_since_epoch().count()));
  reporter.events.report_buffer(reporter.session);
}

void note_control_lost(ArvDevice*, void* user) {
  const Reporter& reporter = *static_cast<Reporter*>(user);
  reporter.events.report_lost(reporter.session, "the camera does not answer, or another application took control");
}

}  // namespace

std::uint64_t CaptureEvents::begin_session() {
  const std::lock_guard lock(mutex_);
  buffers_ = 0;
  triggers_open_ = 0;
  cancelled_ = false;
  lost_.clear();
  return ++session_;
}

void CaptureEvents::report_buffer(std::uint64_t session) {
  const std::lock_guard lock(mutex_);
  if (session != session_) return;
  ++buffers_;
  changed_.notify_all();
}

void CaptureEvents::report_trigger_answered(std::uint64_t session) {
  const std::lock_guard lock(mutex_);
  if (session != session_) return;
  --triggers_open_;
  changed_.notify_all();
}

void CaptureEvents::report_lost(std::uint64_t session, const std::string& reason) {
  const std::lock_guard lock(mutex_);
  if (session != session_ || !lost_.empty()) return;
  lost_ = reason;
  changed_.notify_all();
}

void CaptureEvents::cancel() {
  const std::lock_guard lock(mutex_);
  cancelled_ = true;
  changed_.notify_all();
}

template <class Condition>
CaptureEvents::Wake CaptureEvents::wait(MonotonicTime until, Condition condition) {
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, until, [&] { return cancelled_ || !lost_.empty() || condition(); });
  if (std::exchange(cancelled_, false)) return Wake::kCancelled;
  if (condition()) return Wake::kBuffer;
  return lost_.empty() ? Wake::kTimeout : Wake::kLost;
}

CaptureEvents::Wake CaptureEvents::wait_buffer(MonotonicTime until) {
  const Wake wake = wait(until, [this] { return buffers_ > 0; });
  return wake == Wake::kBuffer && !take_buffer() ? Wake::kTimeout : wake;
}

bool CaptureEvents::take_buffer() {
  const std::lock_guard lock(mutex_);
  if (buffers_ == 0) return false;
  --buffers_;
  return true;
}

bool CaptureEvents::take_cancel() {
  const std::lock_guard lock(mutex_);
  return std::exchange(cancelled_, false);
}

void CaptureEvents::note_trigger_asked() {
  const std::lock_guard lock(mutex_);
  ++triggers_open_;
}

CaptureEvents::Wake CaptureEvents::wait_trigger_answered(MonotonicTime until) {
  return wait(until, [this] { return triggers_open_ == 0; });
}

bool CaptureEvents::trigger_answered() const {
  const std::lock_guard lock(mutex_);
  return triggers_open_ == 0;
}

std::string CaptureEvents::lost_reason() const {
  const std::lock_guard lock(mutex_);
  return lost_;
}

GObjectPtr<ArvStream> make_reporting_stream(ArvCamera* camera, CaptureEvents& events, std::uint64_t session,
                                            GErrorSlot& error) {
  return GObjectPtr<ArvStream>(
      arv_camera_create_stream_full(camera, note_stream, new Reporter{events, session}, free_reporter, error.out()));
}

unsigned long report_loss(ArvDevice* device, CaptureEvents& events, std::uint64_t session) {
  return g_signal_connect_data(device, "control-lost", G_CALLBACK(note_control_lost), new Reporter{events, session},
                               free_signal_reporter, G_CONNECT_DEFAULT);
}

}  // namespace slsd
