// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/doubles/gige/gige_camera.hpp"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <stdexcept>

#include "tests/doubles/gige/chunk_trailer.hpp"
#include "tests/doubles/gige/device_socket.hpp"
#include "tests/doubles/gige/pack_pixels.hpp"

namespace slsd::test {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

constexpr std::uint32_t kFireTestPacket = 1u << 31;
constexpr std::uint32_t kLatch = 2;
constexpr std::uint32_t kLine0 = 0;
constexpr std::uint32_t kSoftware = 1;
constexpr std::uint32_t kLine1 = 2;
constexpr std::uint32_t kAction1 = 3;
constexpr std::uint64_t kNetworkTicksHz = 1'000'000'000;  // of a clock that follows the network's
constexpr std::uint32_t kImagePayload = 1;

std::uint16_t id_after(std::uint16_t id) {
  return id == 65535 ? 1 : static_cast<std::uint16_t>(id + 1);
}

}  // namespace

GigeCamera::GigeCamera(GigeCameraOptions options) : options_(std::move(options)) {
  control_socket_ = bind_control_port(options_.address);
  if (control_socket_ < 0) throw std::runtime_error("the double cannot have the address " + options_.address);
  broadcast_socket_ = bind_broadcast_port();
  wake_event_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  sender_ = std::make_unique<StreamSender>(in_addr{::inet_addr(options_.address.c_str())});
  command_.resize(65536);
  exposures_.reserve(1024);
  power_up();
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

GigeCamera::~GigeCamera() {
  thread_.request_stop();
  wake();
  thread_.join();
  for (const int descriptor : {control_socket_, broadcast_socket_, wake_event_})
    if (descriptor >= 0) ::close(descriptor);
}

void GigeCamera::power_up() {
  registers_ = std::make_unique<RegisterFile>(options_.serial, options_.width_px, options_.height_px);
  registers_->write(kCurrentAddress, ntohl(::inet_addr(options_.address.c_str())));
  registers_->write(kHasChunks, options_.chunks ? 1 : 0);
  registers_->write(kHasSoftwareTrigger, options_.software_trigger ? 1 : 0);
  set_tick_frequency(options_.tick_frequency_hz);
  ControlEvents events;
  events.written = [this](std::uint32_t address, std::uint32_t value) { note_write(address, value); };
  events.resend_asked = [this](std::uint16_t frame, std::uint32_t first, std::uint32_t last) {
    if (faults_.resends && !faults_.silent) sender_->send_again(frame, first, last, target());
  };
  events.controller_left = [this] {
    registers_->write(kAcquisition, 0);
    registers_->write(kStreamPort, 0);
    exposures_.clear();
    sender_->stop();
  };
  events.action = [this](std::optional<std::uint64_t> ticks) {
    if (!ticks) return trigger(kAction1);
    act_at_ = time_at(*ticks);
  };
  port_ = std::make_unique<ControlPort>(*registers_, std::move(events));
  exposures_.clear();
  sender_->stop();
  next_id_ = options_.first_frame_id;
  next_free_.reset();
  act_at_.reset();
  power_up_ = steady_clock::now();
}

void GigeCamera::set_tick_frequency(std::uint64_t frequency_hz) {
  registers_->write(kTickFrequencyHigh, static_cast<std::uint32_t>(frequency_hz >> 32));
  registers_->write(kTickFrequencyLow, static_cast<std::uint32_t>(frequency_hz));
}

void GigeCamera::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    wait_for_work();
    const std::lock_guard lock(mutex_);
    const Time now = steady_clock::now();
    if (back_at_ && now >= *back_at_) {
      back_at_.reset();
      power_up();
    }
    read_commands(control_socket_);
    read_commands(broadcast_socket_);
    port_->expire_controller();
    act_when_due(now);
    run_freely(now);
    send_frames(now);
  }
}

void GigeCamera::wait_for_work() {
  std::array<pollfd, 3> waited{pollfd{control_socket_, POLLIN, 0}, pollfd{wake_event_, POLLIN, 0},
                               pollfd{broadcast_socket_, POLLIN, 0}};
  timespec timeout{0, 100'000'000};
  {
    const std::lock_guard lock(mutex_);
    const Time now = steady_clock::now();
    Time next = now + 100ms;
    if (sender_->sending() || (!exposures_.empty() && sends(now))) next = now;
    if (next_free_) next = std::min(next, *next_free_);
    if (act_at_) next = std::min(next, *act_at_);
    if (faults_.stalled_until && *faults_.stalled_until > now) next = std::min(next, *faults_.stalled_until);
    if (back_at_) next = std::min(next, *back_at_);
    timeout.tv_nsec = std::clamp<std::int64_t>((next - now) / 1ns, 0, 100'000'000);
  }
  ::ppoll(waited.data(), waited.size(), &timeout, nullptr);
  std::uint64_t wakes = 0;
  (void)!::read(wake_event_, &wakes, sizeof(wakes));
}

void GigeCamera::read_commands(int socket) {
  sockaddr_in from{};
  socklen_t from_bytes = sizeof(from);
  for (;;) {
    const auto bytes =
        ::recvfrom(socket, command_.data(), command_.size(), 0, reinterpret_cast<sockaddr*>(&from), &from_bytes);
    if (bytes < 0) return;
    if (faults_.gone || back_at_) continue;
    const auto& answer = port_->answer({command_.data(), static_cast<std::size_t>(bytes)}, from);
    if (answer.empty()) continue;
    ::sendto(control_socket_, answer.data(), answer.size(), 0, reinterpret_cast<const sockaddr*>(&from), from_bytes);
  }
}

void GigeCamera::note_write(std::uint32_t address, std::uint32_t value) {
  if (address == kTriggerSoftware) return trigger(kSoftware);
  if (address == kAcquisition && value == 0) exposures_.clear();
  if (address == kPtpEnable) set_tick_frequency(tick_frequency());
  if (address == kTimestampControl && (value & kLatch) != 0) {
    const std::uint64_t ticks = ticks_at(steady_clock::now());
    registers_->write(kTimestampHigh, static_cast<std::uint32_t>(ticks >> 32));
    registers_->write(kTimestampLow, static_cast<std::uint32_t>(ticks));
  }
  if (address == kStreamPacketSize && (value & kFireTestPacket) != 0) {
    registers_->write(kStreamPacketSize, value & ~kFireTestPacket);
    if (target().packet_bytes <= options_.packet_bytes_max) sender_->send_test_packet(target());
  }
}

void GigeCamera::trigger(std::uint32_t source) {
  const bool waits = registers_->read(kTriggerMode) == 1 && registers_->read(kTriggerSource) == source;
  if (waits && registers_->read(kAcquisition) == 1) expose(steady_clock::now());
}

void GigeCamera::act_when_due(Time now) {
  if (!act_at_ || now < *act_at_) return;
  act_at_.reset();
  trigger(kAction1);
}

void GigeCamera::run_freely(Time now) {
  if (registers_->read(kAcquisition) != 1 || registers_->read(kTriggerMode) != 0) return next_free_.reset();
  if (!next_free_) next_free_ = now;
  if (now < *next_free_) return;
  const std::chrono::microseconds period(std::max(registers_->read(kFramePeriodUs), 1u));
  // A camera whose link is slower than its sensor exposes less often.
  if (exposures_.size() < 2) expose(*next_free_);
  *next_free_ += period;
  if (*next_free_ < now) next_free_ = now;
}

void GigeCamera::expose(Time begin) {
  last_exposure_ = begin;
  exposures_.push_back({next_id_, counter_++, begin});
  next_id_ = id_after(next_id_);
  if (faults_.stale_frames > 0) {
    --faults_.stale_frames;
    exposures_.back().begin -= 1s;
  }
  if (faults_.extra_frames > 0) {
    --faults_.extra_frames;
    exposures_.push_back({next_id_, counter_++, begin});
    next_id_ = id_after(next_id_);
  }
  if (faults_.drop_frames > 0) --faults_.drop_frames, exposures_.pop_back();
  if (faults_.silent || faults_.gone || back_at_) exposures_.clear();
}

bool GigeCamera::sends(Time now) const {
  return !faults_.stalled_until || now >= *faults_.stalled_until;
}

void GigeCamera::send_frames(Time now) {
  if (faults_.gone || back_at_ || !sends(now)) return;
  if (!sender_->sending() && !exposures_.empty()) {
    begin_frame(exposures_.front());
    exposures_.erase(exposures_.begin());
  }
  if (sender_->sending()) sender_->send_some();
}

void GigeCamera::begin_frame(const Exposure& exposure) {
  WireFrame& frame = sender_->next_frame();
  frame.id = exposure.id;
  frame.ticks = ticks_at(exposure.begin + options_.stamp_delay);
  frame.pixel_format = registers_->read(kPixelFormat);
  frame.width_px = registers_->read(kWidth);
  frame.height_px = registers_->read(kHeight);
  options_.frames({static_cast<int>(frame.width_px), static_cast<int>(frame.height_px), used_bits(frame.pixel_format),
                   exposure.counter},
                  frame.pixels);
  pack_pixels(frame.pixel_format, frame.pixels);
  add_chunks(frame, exposure);
  if (faults_.truncate_frames > 0) {
    --faults_.truncate_frames;
    frame.sent_share = 0.5;
  }
  sender_->begin(target());
}

void GigeCamera::add_chunks(WireFrame& frame, const Exposure& exposure) {
  const auto due = [](int& count) { return count > 0 && count-- > 0; };
  frame.payload_type = sends_chunks(*registers_) ? options_.chunk_payload : kImagePayload;
  if (frame.payload_type == kImagePayload) return;
  ChunkValues values{ticks_at(exposure.begin), registers_->read_double(kExposureTime), registers_->read_double(kGain)};
  if (options_.chunks_in_ns)
    values.timestamp = values.timestamp / tick_frequency() * kNetworkTicksHz +
                       values.timestamp % tick_frequency() * kNetworkTicksHz / tick_frequency();
  if (due(faults_.misexposed_frames)) values.exposure_us *= 2.0;
  if (due(faults_.misgained_frames)) values.gain_db += 1.0;
  ChunkFault fault = ChunkFault::kNone;
  if (due(faults_.short_chunk_frames)) fault = ChunkFault::kShort;
  if (due(faults_.garbage_chunk_frames)) fault = ChunkFault::kGarbage;
  append_chunks(*registers_, values, fault, frame.pixels);
}

bool GigeCamera::follows_network() const {
  return registers_->read(kPtpEnable) != 0;
}

std::uint64_t GigeCamera::tick_frequency() const {
  return follows_network() ? kNetworkTicksHz : options_.tick_frequency_hz;
}

// The network's clock is this host's.
GigeCamera::Time GigeCamera::time_at(std::uint64_t ticks) const {
  return Time(std::chrono::nanoseconds(ticks));
}

std::uint64_t GigeCamera::ticks_at(Time time) const {
  if (follows_network()) return static_cast<std::uint64_t>(time.time_since_epoch().count());
  const double seconds = std::chrono::duration<double>(time - power_up_).count() + 10.0;
  return static_cast<std::uint64_t>(seconds * (1.0 + options_.drift_ppm * 1e-6) *
                                    static_cast<double>(options_.tick_frequency_hz));
}

StreamTarget GigeCamera::target() const {
  StreamTarget made;
  made.address = socket_address(htonl(registers_->read(kStreamAddress)),
                                static_cast<std::uint16_t>(registers_->read(kStreamPort) & 0xffff));
  made.packet_bytes = std::max(registers_->read(kStreamPacketSize) & 0xffff, 100u);
  made.packet_delay = std::chrono::nanoseconds(static_cast<std::uint64_t>(registers_->read(kStreamPacketDelay)) *
                                               1'000'000'000 / tick_frequency());
  return made;
}

void GigeCamera::lose_packets(double share, std::uint32_t seed) {
  const std::lock_guard lock(mutex_);
  sender_->lose(share, seed);
}

void GigeCamera::set_faults(const GigeFaults& faults) {
  const std::lock_guard lock(mutex_);
  faults_ = faults;
  wake();
}

void GigeCamera::stall(std::chrono::milliseconds duration) {
  const std::lock_guard lock(mutex_);
  faults_.stalled_until = steady_clock::now() + duration;
  wake();
}

void GigeCamera::blip(std::chrono::milliseconds off) {
  const std::lock_guard lock(mutex_);
  back_at_ = steady_clock::now() + off;
  wake();
}

void GigeCamera::occupy(bool by_another) {
  const std::lock_guard lock(mutex_);
  port_->occupy(by_another);
}

void GigeCamera::pulse_line() {
  const std::lock_guard lock(mutex_);
  trigger(kLine0);
  trigger(kLine1);
  wake();
}

void GigeCamera::hold(Register address) {
  const std::lock_guard lock(mutex_);
  registers_->hold(address);
}

std::uint32_t GigeCamera::read(std::uint32_t address) const {
  const std::lock_guard lock(mutex_);
  return registers_->read(address);
}

double GigeCamera::read_double(std::uint32_t address) const {
  const std::lock_guard lock(mutex_);
  return registers_->read_double(address);
}

std::uint32_t GigeCamera::frames_exposed() const {
  const std::lock_guard lock(mutex_);
  return counter_;
}

GigeCamera::Time GigeCamera::last_exposure() const {
  const std::lock_guard lock(mutex_);
  return last_exposure_;
}

std::uint64_t GigeCamera::packets_lost() const {
  const std::lock_guard lock(mutex_);
  return sender_->packets_lost();
}

std::uint64_t GigeCamera::packets_sent_again() const {
  const std::lock_guard lock(mutex_);
  return sender_->packets_sent_again();
}

int GigeCamera::times_taken() const {
  const std::lock_guard lock(mutex_);
  return port_->times_taken();
}

void GigeCamera::wake() {
  const std::uint64_t one = 1;
  (void)!::write(wake_event_, &one, sizeof(one));
}

}  // namespace slsd::test
