// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/aravis_session.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

constexpr int kWarmUpTries = 3;
constexpr int kFirstClockReadings = 8;
constexpr auto kAnswerTime = 100ms;

/// What the stream's callback and the device's signal report to.
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

// Runs on the stream's thread. Aravis stamps with CLOCK_REALTIME, which jumps.
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

std::chrono::nanoseconds exposure(const AravisCameraOptions& options) {
  return std::chrono::nanoseconds(static_cast<std::int64_t>(options.exposure_us * 1e3));
}

/// How long a frame may take.
std::chrono::nanoseconds patience(const AravisCameraOptions& options) {
  const auto period = std::chrono::duration<double>(options.rate_hz > 0.0 ? 1.0 / options.rate_hz : 0.0);
  return std::chrono::milliseconds(options.frame_timeout_ms) + exposure(options) +
         std::chrono::duration_cast<std::chrono::nanoseconds>(period);
}

}  // namespace

AravisSession::AravisSession(const AravisCameraOptions& options, OpenedDevice device, CaptureEvents& events)
    : options_(options), device_(std::move(device)), events_(events), number_(events.begin_session()) {}

AravisSession::~AravisSession() {
  control_.reset();
  ArvDevice* device = arv_camera_get_device(device_.camera.get());
  if (control_lost_handler_ != 0) g_signal_handler_disconnect(device, control_lost_handler_);
  if (stream_ != nullptr && !abandoned_) (void)stop();
  receiver_.reset();
  stream_.reset();
}

Result<std::unique_ptr<AravisSession>> AravisSession::open(const AravisCameraOptions& options,
                                                           const std::string& address, CaptureEvents& events) {
  auto device = open_device(options, address);
  if (!device) return tl::unexpected(device.error());
  std::unique_ptr<AravisSession> session(new AravisSession(options, std::move(*device), events));
  if (auto prepared = session->prepare(); !prepared) return tl::unexpected(prepared.error());
  return session;
}

bool AravisSession::answers() {
  const auto wake = events_.wait_trigger_answered(steady_clock::now() + kAnswerTime);
  return events_.lost_reason().empty() && wake != CaptureEvents::Wake::kTimeout;
}

Result<> AravisSession::prepare() {
  const DeviceFeatures features(device_.camera.get());
  (void)features.execute("AcquisitionStop");  // one that a former user left running, and most refuse where none runs
  auto layout = configure_image(features, options_);
  if (!layout) return tl::unexpected(layout.error());
  layout_ = *layout;
  if (auto done = configure_packets(device_.camera.get(), options_, warnings_); !done) return done;
  read_clock_first();
  if (auto done = make_stream(); !done) return done;
  if (auto done = warm_up(); !done) return done;
  if (auto done = start(options_.trigger); !done) return done;
  control_ = std::make_unique<DeviceControl>(device_.camera.get(), events_, number_, first_clock_);
  return {};
}

Result<> AravisSession::make_stream() {
  GErrorSlot error;
  ArvDevice* device = arv_camera_get_device(device_.camera.get());
  control_lost_handler_ =
      g_signal_connect_data(device, "control-lost", G_CALLBACK(note_control_lost), new Reporter{events_, number_},
                            free_signal_reporter, G_CONNECT_DEFAULT);
  stream_.reset(arv_camera_create_stream_full(device_.camera.get(), note_stream, new Reporter{events_, number_},
                                              free_reporter, error.out()));
  if (!stream_) return fail(error.code(), "the camera gives no stream: " + error.message(), options_.name);
  configure_stream(stream_.get(), options_, layout_.bytes(), warnings_);
  // After everything else: until now a setting might have changed it.
  const unsigned payload = arv_camera_get_payload(device_.camera.get(), error.out());
  if (error.failed()) return fail(error.code(), "the camera tells no frame size: " + error.message(), options_.name);
  if (payload != layout_.bytes())
    return fail(ErrorCode::kMismatch,
                "the camera sends " + std::to_string(payload) +
                    " bytes a frame, where its size and pixel format make " + std::to_string(layout_.bytes()) +
                    "; turn off what it adds",
                "PayloadSize");
  receiver_ = std::make_unique<FrameReceiver>(stream_.get(), layout_, options_);
  return {};
}

void AravisSession::read_clock_first() {
  for (int i = 0; i < kFirstClockReadings; ++i)
    if (const auto reading = read_device_clock(device_.camera.get())) first_clock_.observe(*reading);
  if (!first_clock_.ready())
    warnings_.push_back({"device_clock",
                         "the camera's clock cannot be read: exposures are taken to end when frames are "
                         "there, and a frame that comes too late ends the session"});
}

// The size of the receive buffer is put in force with the first packet, which is lost with its frame where the buffer
// was too small; and only a frame proves that the data's way is open.
Result<> AravisSession::warm_up() {
  const DeviceFeatures features(device_.camera.get());
  const bool software = features.has_entry("TriggerSource", "Software");
  if (options_.trigger != AravisTrigger::kFreeRun && !software) return {};
  const AravisTrigger trigger = software ? AravisTrigger::kSoftware : AravisTrigger::kFreeRun;
  if (auto done = start(trigger); !done) return done;
  for (int i = 0; i < kWarmUpTries; ++i) {
    if (wait_for_any_frame(trigger)) return stop();
  }
  return fail_here(ErrorCode::kDisconnected,
                   "the camera answers, and sends no frame; check that it is reached through the right interface, and "
                   "that no firewall holds back UDP from its address");
}

bool AravisSession::wait_for_any_frame(AravisTrigger trigger) {
  GErrorSlot error;
  if (trigger == AravisTrigger::kSoftware) arv_camera_software_trigger(device_.camera.get(), error.out());
  if (error.failed() || events_.wait_buffer(steady_clock::now() + patience(options_)) != CaptureEvents::Wake::kBuffer)
    return false;
  receiver_->discard();
  return true;
}

Result<> AravisSession::start(AravisTrigger trigger) {
  const DeviceFeatures features(device_.camera.get());
  if (auto done = configure_trigger(features, options_, trigger); !done) return done;
  while (events_.take_buffer()) receiver_->discard();
  receiver_->restart();
  return features.execute("AcquisitionStart");
}

Result<> AravisSession::stop() {
  return DeviceFeatures(device_.camera.get()).execute("AcquisitionStop");
}

Result<Frame> AravisSession::capture(MonotonicTime deadline) {
  if (events_.take_cancel()) return fail_here(ErrorCode::kCancelled, "the capture was cancelled");
  if (deadline <= steady_clock::now()) return fail_here(ErrorCode::kFrameLate, "the deadline is past");
  if (receiver_->all_held()) return fail_here(ErrorCode::kBusy, "all frames are held; give some back first");
  if (auto settled = settle(deadline); !settled) return tl::unexpected(settled.error());
  const MonotonicTime asked = steady_clock::now();
  if (options_.trigger == AravisTrigger::kSoftware) {
    triggered_ = asked;
    ++frames_due_;
    control_->trigger();
  }
  return await_frame(asked, deadline);
}

// Frames of captures that were cancelled or late must have come, or been given up, before the next trigger: a frame
// tells which trigger it answers by its time only.
Result<> AravisSession::settle(MonotonicTime deadline) {
  while (events_.take_buffer()) {
    receiver_->discard();
    if (frames_due_ > 0) --frames_due_;
  }
  if (options_.trigger != AravisTrigger::kSoftware) return {};
  const MonotonicTime limit = std::min(deadline, triggered_ + patience(options_));
  while (frames_due_ > 0 || !events_.trigger_answered()) {
    const auto wake = frames_due_ > 0 ? events_.wait_buffer(limit) : events_.wait_trigger_answered(limit);
    if (wake == CaptureEvents::Wake::kLost) return lost(events_.lost_reason());
    if (wake == CaptureEvents::Wake::kCancelled) return fail_here(ErrorCode::kCancelled, "the capture was cancelled");
    if (wake == CaptureEvents::Wake::kTimeout) {
      if (deadline <= limit)
        return fail_here(ErrorCode::kFrameLate, "the frame of the trigger before has not come yet");
      const auto error = missed(deadline);
      if (error.value().code == ErrorCode::kDisconnected) return error;
    } else if (frames_due_ > 0) {
      receiver_->discard();
      --frames_due_;
    }
  }
  return {};
}

Result<Frame> AravisSession::await_frame(MonotonicTime asked, MonotonicTime deadline) {
  const bool paced = options_.trigger != AravisTrigger::kLine;
  const MonotonicTime limit = paced ? std::min(deadline, asked + patience(options_)) : deadline;
  for (;;) {
    switch (events_.wait_buffer(limit)) {
      case CaptureEvents::Wake::kCancelled:
        return fail_here(ErrorCode::kCancelled, "the capture was cancelled");
      case CaptureEvents::Wake::kLost:
        return lost(events_.lost_reason());
      case CaptureEvents::Wake::kTimeout:
        if (deadline <= limit && steady_clock::now() - asked < patience(options_))
          return fail_here(ErrorCode::kFrameLate, "no frame came before the deadline");
        return missed(deadline);
      case CaptureEvents::Wake::kBuffer:
        if (auto judged = judge(asked)) return std::move(*judged);
    }
  }
}

// Passed over is a stale frame of a line or clock that runs on, and what still comes of a trigger given up before.
std::optional<Result<Frame>> AravisSession::judge(MonotonicTime asked) {
  auto taken = receiver_->take(asked, control_->clock());
  const bool software = options_.trigger == AravisTrigger::kSoftware;
  if (!taken && !software && taken.error().code == ErrorCode::kFrameStale) return std::nullopt;
  if (!taken && software && frames_missed_ > 0) return --frames_missed_, std::nullopt;
  if (frames_due_ > 0) --frames_due_;
  if (!taken) return Result<Frame>(tl::unexpected(taken.error()));
  if (!*taken) return std::nullopt;
  frames_missed_ = 0;
  return Result<Frame>(std::move(**taken));
}

tl::unexpected<Error> AravisSession::missed(MonotonicTime deadline) {
  if (options_.trigger == AravisTrigger::kSoftware && !events_.trigger_answered())
    return lost("the camera does not answer a trigger");
  frames_due_ = 0;
  ++frames_missed_;
  // Without the device's clock a frame that comes after all would be taken for the next.
  const bool enough = frames_missed_ >= options_.missed_frames_max || !first_clock_.ready();
  if (options_.trigger != AravisTrigger::kLine && enough) return lost("the camera answers, and sends no frames");
  if (steady_clock::now() >= deadline) return fail_here(ErrorCode::kFrameLate, "no frame came before the deadline");
  return fail_here(ErrorCode::kFrameDropped, "no frame came within " + std::to_string(options_.frame_timeout_ms) +
                                                 " ms; it is lost, or frame_timeout_ms is too short");
}

tl::unexpected<Error> AravisSession::lost(const std::string& reason) {
  return fail_here(ErrorCode::kDisconnected, reason + "; check power, cable and network of " + device_.name);
}

tl::unexpected<Error> AravisSession::fail_here(ErrorCode code, std::string message) const {
  return fail(code, std::move(message), options_.name);
}

}  // namespace slsd
