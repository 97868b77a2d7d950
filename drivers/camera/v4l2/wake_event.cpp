// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/v4l2/wake_event.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <cstdint>

namespace slsd {
namespace {

using namespace std::chrono_literals;

timespec time_left(MonotonicTime deadline) {
  const auto left = std::clamp<std::chrono::nanoseconds>(deadline - std::chrono::steady_clock::now(), 0ns, 1h);
  return {left / 1s, (left % 1s).count()};
}

}  // namespace

WakeEvent::WakeEvent() : event_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  assert(event_ >= 0);
}

WakeEvent::~WakeEvent() {
  close(event_);
}

WakeEvent::Woken WakeEvent::wait(int device, MonotonicTime deadline) const {
  while (true) {
    std::array<pollfd, 2> files{pollfd{event_, POLLIN, 0}, pollfd{device, POLLIN, 0}};
    const timespec left = time_left(deadline);
    const int ready = ppoll(files.data(), files.size(), &left, nullptr);
    if (ready < 0 && errno != EINTR) return Woken::kGone;
    if (ready > 0 && files[0].revents != 0) {
      reset();
      return Woken::kCancelled;
    }
    if (ready > 0 && (files[1].revents & (POLLERR | POLLHUP | POLLNVAL)) != 0) return Woken::kGone;
    if (ready > 0) return Woken::kReady;
    if (std::chrono::steady_clock::now() >= deadline) return Woken::kLate;
  }
}

void WakeEvent::cancel() const {
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = write(event_, &one, sizeof one);
}

void WakeEvent::reset() const {
  std::uint64_t count = 0;
  [[maybe_unused]] const auto count_read = read(event_, &count, sizeof count);
}

}  // namespace slsd
