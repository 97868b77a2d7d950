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

#include "tests/doubles/gige/device_socket.hpp"
#include "tests/doubles/gige/frames/compose_frame.hpp"

namespace slsd::test {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

constexpr std::uint32_t kFireTestPacket = 1u << 31;
constexpr std::uint32_t kLatch = 2;

}  // namespace

GigeCamera::GigeCamera(GigeCameraOptions options) : options_(std::move(options)) {
  control_socket_ = bind_control_port(options_.address);
  if (control_socket_ < 0) throw std::runtime_error("the double cannot have the address " + options_.address);
  broadcast_socket_ = bind_broadcast_port();
  wake_event_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  sender_ = std::make_unique<StreamSender>(in_addr{::inet_addr(options_.address.c_str())});
  if (options_.breaks_up) sender_->break_up();
  command_.resize(65536);
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
  registers_->write(kPtpStatus, options_.ptp_status);
  clock_.emplace(*registers_, options_.tick_frequency_hz, options_.drift_ppm, options_.clock_fault);
  port_ = std::make_unique<ControlPort>(*registers_, control_events());
  sensor_.power_up(*registers_, options_.first_frame_id, options_.readout);
  sender_->stop();
}

ControlEvents GigeCamera::control_events() {
  ControlEvents events;
  events.written = [this](std::uint32_t address, std::uint32_t value) { note_write(address, value); };
  events.resend_asked = [this](std::uint16_t frame, std::uint32_t first, std::uint32_t last) {
    if (trouble_.faults.resends && !trouble_.faults.silent) sender_->send_again(frame, first, last, target());
  };
  events.controller_left = [this] {
    registers_->write(kAcquisition, 0);
    registers_->write(kStreamPort, 0);
    sensor_.discard_exposures();
    sender_->stop();
  };
  events.action = [this](std::optional<std::uint64_t> ticks) {
    if (!ticks) return sensor_.trigger(Sensor::Source::kAction1);
    sensor_.act_at(TickClock::network_time(*ticks));
  };
  return events;
}

void GigeCamera::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    wait_for_work();
    const std::lock_guard lock(mutex_);
    const Time now = steady_clock::now();
    if (trouble_.off_until && now >= *trouble_.off_until) {
      trouble_.off_until.reset();
      power_up();
    }
    read_commands(control_socket_);
    read_commands(broadcast_socket_);
    port_->expire_controller();
    sensor_.expose_when_due(now);
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
    timeout.tv_nsec = std::clamp<std::int64_t>((next_work(now) - now) / 1ns, 0, 100'000'000);
  }
  ::ppoll(waited.data(), waited.size(), &timeout, nullptr);
  std::uint64_t wakes = 0;
  (void)!::read(wake_event_, &wakes, sizeof(wakes));
}

GigeCamera::Time GigeCamera::next_work(Time now) const {
  if (sender_->sending() || (sensor_.has_exposures(now) && !trouble_.stalled(now))) return now;
  const Time due = trouble_.stalled(now) ? now + 100ms : sensor_.next_due();
  return std::min({now + 100ms, due, trouble_.next_end(now)});
}

void GigeCamera::read_commands(int socket) {
  sockaddr_in from{};
  socklen_t from_bytes = sizeof(from);
  for (;;) {
    const auto bytes =
        ::recvfrom(socket, command_.data(), command_.size(), 0, reinterpret_cast<sockaddr*>(&from), &from_bytes);
    if (bytes < 0) return;
    if (trouble_.off()) continue;
    if (trouble_.faults.dies_after == 0) trouble_.faults.gone = true;
    if (trouble_.faults.dies_after >= 0 && trouble_.faults.dies_after-- == 0) continue;
    const auto& answer = port_->answer({command_.data(), static_cast<std::size_t>(bytes)}, from);
    if (answer.empty()) continue;
    ::sendto(control_socket_, answer.data(), answer.size(), 0, reinterpret_cast<const sockaddr*>(&from), from_bytes);
  }
}

void GigeCamera::note_write(std::uint32_t address, std::uint32_t value) {
  if (address == kTriggerSoftware) return sensor_.trigger(Sensor::Source::kSoftware);
  if (address == kAcquisition && value == 0) sensor_.discard_exposures();
  if (address == kAcquisition && value == 1) {
    if (options_.restarts_ids) sensor_.restart_ids(), sender_->forget();
    sensor_.arm_at(steady_clock::now() + options_.arming);
  }
  if (address == kPtpEnable) clock_->show_frequency();
  if (address == kTimestampControl && (value & kLatch) != 0) clock_->latch();
  if (address == kStreamPacketSize && (value & kFireTestPacket) != 0) {
    registers_->write(kStreamPacketSize, value & ~kFireTestPacket);
    if (target().packet_bytes <= options_.packet_bytes_max) sender_->send_test_packet(target());
  }
}

void GigeCamera::send_frames(Time now) {
  if (trouble_.off() || trouble_.stalled(now)) return;
  if (!sender_->sending() && sensor_.has_exposures(now)) {
    compose_frame(sensor_.take_exposure(), *registers_, *clock_, options_, trouble_.faults, sender_->next_frame());
    sender_->begin(target());
  }
  if (sender_->sending()) sender_->send_some();
}

StreamTarget GigeCamera::target() const {
  StreamTarget made;
  made.address = socket_address(htonl(registers_->read(kStreamAddress)),
                                static_cast<std::uint16_t>(registers_->read(kStreamPort) & 0xffff));
  made.packet_bytes = std::max(registers_->read(kStreamPacketSize) & 0xffff, 100u);
  made.packet_delay = std::chrono::nanoseconds(static_cast<std::uint64_t>(registers_->read(kStreamPacketDelay)) *
                                               1'000'000'000 / clock_->frequency_hz());
  return made;
}

void GigeCamera::lose_packets(double share, std::uint32_t seed) {
  const std::lock_guard lock(mutex_);
  sender_->lose(share, seed);
}

void GigeCamera::set_faults(const GigeFaults& faults) {
  const std::lock_guard lock(mutex_);
  trouble_.faults = faults;
  wake();
}

void GigeCamera::set_clock_fault(ClockFault fault) {
  const std::lock_guard lock(mutex_);
  options_.clock_fault = fault;
  clock_->set_fault(fault);
}

void GigeCamera::stall(std::chrono::milliseconds duration) {
  const std::lock_guard lock(mutex_);
  trouble_.faults.stalled_until = steady_clock::now() + duration;
  wake();
}

void GigeCamera::blip(std::chrono::milliseconds off) {
  const std::lock_guard lock(mutex_);
  trouble_.off_until = steady_clock::now() + off;
  wake();
}

void GigeCamera::occupy(bool by_another) {
  const std::lock_guard lock(mutex_);
  port_->occupy(by_another);
}

void GigeCamera::pulse_line() {
  const std::lock_guard lock(mutex_);
  for (const auto line : {Sensor::Source::kLine0, Sensor::Source::kLine1}) sensor_.trigger(line);
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
  return sensor_.counter();
}

GigeCamera::Time GigeCamera::exposure_of(std::uint32_t counter) const {
  const std::lock_guard lock(mutex_);
  return sensor_.begin_of(counter);
}

GigeCamera::Time GigeCamera::last_exposure() const {
  const std::lock_guard lock(mutex_);
  return sensor_.last_exposure();
}

std::uint64_t GigeCamera::packets_lost() const {
  const std::lock_guard lock(mutex_);
  return sender_->packets_lost();
}

std::uint64_t GigeCamera::packets_sent_again() const {
  const std::lock_guard lock(mutex_);
  return sender_->packets_sent_again();
}

bool GigeCamera::is_gone() const {
  const std::lock_guard lock(mutex_);
  return trouble_.faults.gone;
}

int GigeCamera::times_taken() const {
  const std::lock_guard lock(mutex_);
  return port_->times_taken();
}

ActionCounts GigeCamera::actions() const {
  const std::lock_guard lock(mutex_);
  return port_->actions();
}

void GigeCamera::wake() {
  const std::uint64_t one = 1;
  (void)!::write(wake_event_, &one, sizeof(one));
}

}  // namespace slsd::test
