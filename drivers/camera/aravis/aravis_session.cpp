// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/aravis_session.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "drivers/camera/aravis/aravis_camera_options.hpp"
#include "drivers/camera/aravis/device/configure_device.hpp"
#include "drivers/camera/aravis/frames/capture_events.hpp"
#include "drivers/camera/aravis/gige/configure_network.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

constexpr int kFirstClockReadings = 8;
constexpr auto kAnswerTime = 100ms;
constexpr auto kReadoutMost = 1s;
constexpr auto kClockPause = 3ms;
constexpr auto kArming = 5ms;
constexpr int kStreamsMax = 10;
constexpr auto kRingRead = 20ms;  // the kernel hands over a packet socket's data every 5 ms

}  // namespace

AravisSession::AravisSession(const AravisCameraOptions& options, OpenedDevice device, CaptureEvents& events)
    : options_(options),
      device_(std::move(device)),
      events_(events),
      number_(events.begin_session()),
      first_clock_(options.ptp || options.device_clock == AravisClock::kDevice) {}

AravisSession::~AravisSession() {
  ArvDevice* device = arv_camera_get_device(device_.camera.get());
  // Gives up control first, so that the next session is not refused if the network returns meanwhile.
  if (abandoned_ && ARV_IS_GV_DEVICE(device)) (void)arv_gv_device_leave_control(ARV_GV_DEVICE(device), nullptr);
  control_.reset();
  if (control_lost_handler_ != 0) g_signal_handler_disconnect(device, control_lost_handler_);
  if (stream_ != nullptr && !abandoned_) (void)stop();
  receiver_.reset();
  stream_.reset();
}

Result<std::unique_ptr<AravisSession>> AravisSession::open(const AravisCameraOptions& options,
                                                           const std::string& address, CaptureEvents& events,
                                                           const std::function<void()>& found) {
  auto device = open_device(options, address);
  if (!device) return tl::unexpected(device.error());
  if (found) found();
  std::unique_ptr<AravisSession> session(new AravisSession(options, std::move(*device), events));
  if (auto prepared = session->prepare(); !prepared) return tl::unexpected(prepared.error());
  return session;
}

bool AravisSession::answers() {
  const auto wake = events_.wait_trigger_answered(steady_clock::now() + kAnswerTime);
  return events_.lost_reason().empty() && wake != CaptureEvents::Wake::kTimeout;
}

Result<> AravisSession::check() {
  return frame_capture_->check();
}

Result<> AravisSession::prepare() {
  const DeviceFeatures features(device_.camera.get());
  (void)features.execute("AcquisitionStop");  // a former user's; most cameras refuse if none runs
  auto layout = configure_image(features, options_);
  if (!layout) return tl::unexpected(layout.error());
  layout_ = *layout;
  auto chunks = configure_chunks(features, options_);
  if (!chunks) return tl::unexpected(chunks.error());
  chunks_ = *chunks;
  if (auto done = configure_clock(features, options_); !done) return done;
  if (auto done = configure_packets(device_.camera.get(), options_, warnings_); !done) return done;
  in_addr camera{};
  if (::inet_pton(AF_INET, device_.address.c_str(), &camera) == 1) fragments_ = FragmentWatch(camera);
  read_clock_first();
  control_lost_handler_ = report_loss(arv_camera_get_device(device_.camera.get()), events_, number_);
  if (auto done = join_group(); !done) return done;
  if (auto done = begin(); !done) return done;
  control_ = std::make_unique<DeviceControl>(device_.camera.get(), events_, number_, first_clock_, first_ptp_);
  frame_capture_.emplace(options_, device_.name, events_, *receiver_, *control_, action_ ? &*action_ : nullptr);
  note_clock();
  note_fragments();
  return {};
}

Result<> AravisSession::join_group() {
  if (options_.trigger != AravisTrigger::kAction) return {};
  if (device_.address.empty())
    return fail_here(ErrorCode::kUnsupported,
                     "only GigE Vision cameras support the trigger \"action\"; set another one");
  action_.emplace(ActionGroup::of(options_.action), device_.address, options_.interface);
  return {};
}

void AravisSession::abandon() {
  abandoned_ = true;
  frame_capture_.reset();
  action_.reset();
}

Result<> AravisSession::make_stream() {
  GErrorSlot error;
  receiver_.reset();
  stream_.reset();
  while (events_.take_buffer()) continue;  // those buffers ended with their stream
  stream_ = make_reporting_stream(device_.camera.get(), events_, number_, error);
  if (!stream_) return fail(error.code(), "the camera does not open a stream: " + error.message(), options_.name);
  std::vector<NetworkWarning> warnings;
  configure_stream(stream_.get(), options_, layout_.bytes(), warnings);
  for (NetworkWarning& warning : warnings)
    if (std::ranges::find(warnings_, warning.name, &NetworkWarning::name) == warnings_.end())
      warnings_.push_back(std::move(warning));
  const auto payload = read_payload_bytes(device_.camera.get(), layout_, chunks_);
  if (!payload) return tl::unexpected(payload.error());
  receiver_ = std::make_unique<FrameReceiver>(stream_.get(), layout_, options_, *payload, make_chunk_reader());
  return {};
}

std::unique_ptr<ChunkReader> AravisSession::make_chunk_reader() const {
  if (!chunks_.any()) return nullptr;
  return std::make_unique<ChunkReader>(device_.camera.get(), chunks_, layout_.bytes(),
                                       from_us(options_.exposure_us) + kReadoutMost);
}

// Read the lock before the clock: a locked clock has already been set.
void AravisSession::read_clock_first() {
  if (options_.ptp) first_ptp_ = read_ptp_lock(device_.camera.get());
  for (int i = 0; i < kFirstClockReadings; ++i)
    if (const auto reading = read_device_clock(device_.camera.get())) first_clock_.observe(*reading);
}

// Observe an inconsistent clock until its fault is known.
void AravisSession::read_clock_again() {
  for (int i = 0; i < kFirstClockReadings && first_clock_.ready(); ++i) {
    const auto reading = read_device_clock(device_.camera.get());
    if (!reading || first_clock_.observe(*reading)) return;
    std::this_thread::sleep_for(kClockPause);
  }
}

bool AravisSession::note_clock() {
  if (clock_reported_ || options_.device_clock == AravisClock::kArrival) return false;
  const DeviceClock clock = control_->clock();
  if (!receiver_->goes_by_arrival(clock)) return false;
  warnings_.push_back(device_clock_warning(!clock.was_read()                 ? "cannot be read"
                                           : receiver_->stamps_are_foreign() ? "is not the one that stamps its frames"
                                                                             : clock.fault()));
  return clock_reported_ = true;
}

bool AravisSession::note_fragments() {
  if (fragments_reported_ || !fragments_.seen()) return false;
  warnings_.push_back(fragments_warning(options_.packet_bytes, interface_of(device_.camera.get())));
  return fragments_reported_ = true;
}

// Software triggers and free run verify the final stream itself. For a line or an action, a command verifies the
// stream, and the camera must stop in between. Many cameras then restart their frame numbers at 1, which Aravis would
// discard as late frames. So the capture gets a new stream.
Result<> AravisSession::begin() {
  const bool own = options_.trigger == AravisTrigger::kSoftware || options_.trigger == AravisTrigger::kFreeRun;
  const bool commanded = DeviceFeatures(device_.camera.get()).has_entry("TriggerSource", "Software");
  if (auto done = make_stream(); !done) return done;
  if (own || commanded)
    if (auto done = warm_up(own ? options_.trigger : AravisTrigger::kSoftware); !done) return done;
  if (own) return receiver_->restart(), Result<>();
  if (!commanded) {
    warnings_.push_back(first_frame_warning());
    return start(options_.trigger);
  }
  if (auto done = stop(); !done) return done;
  if (auto done = make_stream(); !done) return done;
  return start(options_.trigger);
}

// Only a frame proves that the data path is open, for each new stream.
Result<> AravisSession::warm_up(AravisTrigger trigger) {
  bool unreadable = false;
  for (int i = 0; i < kFirstFrameTries; ++i) {
    if (auto done = i > 0 ? make_stream() : Result<>(); !done) return done;
    if (auto done = start(trigger); !done) return done;
    const auto first = wait_for_first_frame(trigger, first_frame_timeout(options_, trigger, i));
    if (!first) return tl::unexpected(first.error());
    if (*first == FirstFrame::kCame) return {};
    if (auto done = stop(); !done) return done;
    unreadable = unreadable || *first == FirstFrame::kUnreadable;
  }
  if (unreadable) return go_without_chunks(trigger);
  if (note_fragments()) return fail_here(ErrorCode::kDisconnected, warnings_.back().advice);
  return fail_here(ErrorCode::kDisconnected,
                   "the camera answers but sends no frame; check that slsd reaches it through the right interface, and "
                   "that no firewall blocks UDP from its address");
}

Result<AravisSession::FirstFrame> AravisSession::wait_for_first_frame(AravisTrigger trigger,
                                                                      std::chrono::nanoseconds time) {
  GErrorSlot error;
  if (trigger == AravisTrigger::kSoftware) arv_camera_software_trigger(device_.camera.get(), error.out());
  if (error.failed()) return FirstFrame::kMissing;
  switch (events_.wait_buffer(steady_clock::now() + time)) {
    case CaptureEvents::Wake::kCancelled:
      return fail_here(ErrorCode::kCancelled, "opening was cancelled");
    case CaptureEvents::Wake::kLost:
      return fail_here(ErrorCode::kDisconnected, events_.lost_reason() + "; check power, cable and network");
    case CaptureEvents::Wake::kTimeout:
      return FirstFrame::kMissing;
    case CaptureEvents::Wake::kBuffer:
      break;
  }
  read_clock_again();
  return receiver_->discard_readable(first_clock_) ? FirstFrame::kCame : FirstFrame::kUnreadable;
}

Result<> AravisSession::go_without_chunks(AravisTrigger trigger) {
  chunks_ = {};
  warnings_.push_back(chunks_warning());
  if (auto done = turn_chunks_off(DeviceFeatures(device_.camera.get())); !done) return done;
  if (auto done = make_stream(); !done) return done;
  return warm_up(trigger);
}

bool AravisSession::heard_others() const {
  if (!takes_packet_socket(stream_.get(), options_)) return false;
  std::this_thread::sleep_for(kRingRead);
  return arv_stream_get_info_uint64_by_name(stream_.get(), "n_received_packets") > 0;
}

// A packet socket hears every packet of the interface until its filter is set. Because of another camera's frame
// number, Aravis would discard this camera's frames as late, or wait for missing ones. If the interface is never silent
// long enough, only the UDP socket remains.
Result<> AravisSession::hear_camera_only() {
  for (int streams = 1; heard_others(); ++streams) {
    if (streams == kStreamsMax) {
      options_.packet_socket = false;
      choose_socket(device_.camera.get(), options_);
      warnings_.push_back(packet_socket_warning(interface_of(device_.camera.get())));
    }
    if (auto done = make_stream(); !done) return done;
  }
  return {};
}

// Some cameras ignore triggers for a moment after they have started.
Result<> AravisSession::start(AravisTrigger trigger) {
  const DeviceFeatures features(device_.camera.get());
  if (auto done = configure_trigger(features, options_, trigger); !done) return done;
  if (auto done = hear_camera_only(); !done) return done;
  while (events_.take_buffer()) receiver_->discard();
  receiver_->begin();
  if (auto done = features.execute("AcquisitionStart"); !done) return done;
  if (trigger != AravisTrigger::kFreeRun) std::this_thread::sleep_for(kArming);
  return {};
}

Result<> AravisSession::stop() {
  return DeviceFeatures(device_.camera.get()).execute("AcquisitionStop");
}

Result<> AravisSession::set_exposure(double exposure_us) {
  if (auto there = check(); !there) return there;
  const auto set = [&] { return configure_exposure(DeviceFeatures(device_.camera.get()), exposure_us); };
  if (auto done = control_->use_camera(set); !done) return done;
  options_.exposure_us = exposure_us;  // the stream's parts refer to these options
  return {};
}

Result<Frame> AravisSession::capture(MonotonicTime deadline) {
  return frame_capture_->capture(deadline);
}

Result<Frame> AravisSession::capture_since(MonotonicTime since, MonotonicTime deadline) {
  return frame_capture_->capture_since(since, deadline);
}

tl::unexpected<Error> AravisSession::fail_here(ErrorCode code, std::string message) const {
  return fail(code, std::move(message), options_.name);
}

}  // namespace slsd
