// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/doubles/gige/tick_clock.hpp"

namespace slsd::test {
namespace {

constexpr std::uint64_t kNetworkTicksHz = 1'000'000'000;  // of a clock that follows the network's

}  // namespace

TickClock::TickClock(RegisterFile& registers, std::uint64_t frequency_hz, double drift_ppm, ClockFault fault)
    : registers_(registers), own_frequency_hz_(frequency_hz), drift_ppm_(drift_ppm), fault_(fault) {
  show_frequency();
}

void TickClock::show_frequency() {
  registers_.write(kTickFrequencyHigh, static_cast<std::uint32_t>(frequency_hz() >> 32));
  registers_.write(kTickFrequencyLow, static_cast<std::uint32_t>(frequency_hz()));
}

void TickClock::latch() {
  const std::uint64_t ticks = shown(ticks_at(std::chrono::steady_clock::now()));
  registers_.write(kTimestampHigh, static_cast<std::uint32_t>(ticks >> 32));
  registers_.write(kTimestampLow, static_cast<std::uint32_t>(ticks));
}

std::uint64_t TickClock::shown(std::uint64_t ticks) {
  ++latches_;
  switch (fault_) {
    case ClockFault::kNone:
      return ticks;
    case ClockFault::kStandsStill:
      return 0;
    case ClockFault::kOtherEpoch:
      return ticks + 3600 * frequency_hz();
    case ClockFault::kOtherRate:
      return 2 * ticks;
    case ClockFault::kGoesBack:
      return (1000 - latches_) * frequency_hz();
  }
  return ticks;
}

bool TickClock::follows_network() const {
  return registers_.read(kPtpEnable) != 0;
}

std::uint64_t TickClock::frequency_hz() const {
  return follows_network() ? kNetworkTicksHz : own_frequency_hz_;
}

std::uint64_t TickClock::ticks_at(Time time) const {
  if (follows_network()) return static_cast<std::uint64_t>(time.time_since_epoch().count());
  const double seconds = std::chrono::duration<double>(time - begin_).count() + 10.0;
  return static_cast<std::uint64_t>(seconds * (1.0 + drift_ppm_ * 1e-6) * static_cast<double>(own_frequency_hz_));
}

std::uint64_t TickClock::in_ns(std::uint64_t ticks) const {
  const std::uint64_t frequency = frequency_hz();
  return ticks / frequency * kNetworkTicksHz + ticks % frequency * kNetworkTicksHz / frequency;
}

}  // namespace slsd::test
