// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/system/wake_event.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>

#include "drivers/system/system_error.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

timespec time_left(WakeEvent::Time until) {
  const auto now = std::chrono::time_point_cast<std::chrono::nanoseconds>(steady_clock::now());
  if (until <= now) return {};
  const auto left = until - now > 1h ? std::chrono::nanoseconds(1h) : until - now;
  return {left / 1s, (left % 1s).count()};
}

}  // namespace

WakeEvent::~WakeEvent() {
  if (number_ >= 0) ::close(number_);
}

Result<> WakeEvent::open() {
  if (number_ >= 0) return {};
  const int number = ::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (number < 0) return fail_system(errno, "cannot create an event to wait for");
  number_ = number;
  if (woken_) wake();  // wake() came before, or during open()
  return {};
}

WakeEvent::Woken WakeEvent::wait(int descriptor, Time until) const {
  while (true) {
    std::array<pollfd, 2> files{pollfd{number_, POLLIN, 0}, pollfd{descriptor, POLLIN, 0}};
    const timespec left = time_left(until);
    const int ready = woken_ ? 0 : ::ppoll(files.data(), files.size(), &left, nullptr);
    if (ready < 0 && errno != EINTR) return Woken::kGone;
    if ((woken_ || files[0].revents != 0) && take()) return Woken::kWoken;
    if (ready > 0 && (files[1].revents & (POLLERR | POLLHUP | POLLNVAL)) != 0) return Woken::kGone;
    if (ready > 0 && files[1].revents != 0) return Woken::kReady;
    if (steady_clock::now() >= until) return Woken::kLate;
  }
}

bool WakeEvent::sleep_until(Time until) const {
  return wait(-1, until) == Woken::kWoken;
}

void WakeEvent::wake() const {
  woken_ = true;
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(number_, &one, sizeof one);
}

void WakeEvent::reset() const {
  static_cast<void>(take());
}

// Reset the event first: a wake() in between leaves the flag, and at worst one poll() ends early.
bool WakeEvent::take() const {
  std::uint64_t count = 0;
  [[maybe_unused]] const auto count_read = ::read(number_, &count, sizeof count);
  return woken_.exchange(false);
}

}  // namespace slsd
