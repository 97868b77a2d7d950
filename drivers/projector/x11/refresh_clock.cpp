// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/x11/refresh_clock.hpp"

#include <cmath>
#include <cstdlib>
#include <thread>

#include <poll.h>
#include <xcb/present.h>
#include <xcb/xcb.h>

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

constexpr auto kTimeout = 5s;  // a busy machine is not an unplugged projector
constexpr auto kOldest = 1s;
constexpr int kRefreshesUntilAFlip = 3;

struct FreeMemory {
  void operator()(void* memory) const { std::free(memory); }
};
template <class T>
using Reply = std::unique_ptr<T, FreeMemory>;

// A driver without a vertical blank may give no stamps, or stamps from another clock.
MonotonicTime plausible(std::uint64_t monotonic_us) {
  const auto now = steady_clock::now();
  const MonotonicTime time{std::chrono::microseconds(monotonic_us)};
  return time <= now && now - time < kOldest ? time : now;
}

bool has_present(xcb_connection_t* connection) {
  const auto* extension = xcb_get_extension_data(connection, &xcb_present_id);
  if (extension == nullptr || extension->present == 0) return false;
  const auto cookie = xcb_present_query_version(connection, 1, 0);
  return Reply<xcb_present_query_version_reply_t>(xcb_present_query_version_reply(connection, cookie, nullptr)) !=
         nullptr;
}

}  // namespace

RefreshClock::RefreshClock(double refresh_hz) : period_(std::llround(1e9 / (refresh_hz > 0 ? refresh_hz : 50.0))) {}

std::unique_ptr<RefreshClock> RefreshClock::open(const std::string& display, std::uint32_t window, double refresh_hz) {
  std::unique_ptr<RefreshClock> clock(new RefreshClock(refresh_hz));
  clock->connect(display, window);
  return clock;
}

void RefreshClock::connect(const std::string& display, std::uint32_t window) {
  connection_ = xcb_connect(display.c_str(), nullptr);
  window_ = window;
  if (xcb_connection_has_error(connection_) != 0 || !has_present(connection_)) return;
  const std::uint32_t id = xcb_generate_id(connection_);
  events_ = xcb_register_for_special_xge(connection_, &xcb_present_id, id, nullptr);
  xcb_present_select_input(connection_, id, window, XCB_PRESENT_EVENT_MASK_COMPLETE_NOTIFY);
}

RefreshClock::~RefreshClock() {
  if (events_ != nullptr) xcb_unregister_for_special_event(connection_, events_);
  xcb_disconnect(connection_);
}

void RefreshClock::prepare() {
  if (events_ == nullptr) return;
  while (auto* event = xcb_poll_for_special_event(connection_, events_)) std::free(event);
  flipped_.reset();
}

bool RefreshClock::wait_readable(MonotonicTime deadline) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - steady_clock::now());
  pollfd readable{xcb_get_file_descriptor(connection_), POLLIN, 0};
  return left > 0ms && ::poll(&readable, 1, static_cast<int>(left.count())) > 0 &&
         xcb_connection_has_error(connection_) == 0;
}

// Waits for the answer to the request of that number; with 0, for the next flip. Notes flips that come before it.
std::optional<RefreshClock::Refresh> RefreshClock::next_event(std::uint32_t serial, MonotonicTime deadline) {
  do {
    while (const Reply<xcb_generic_event_t> event{xcb_poll_for_special_event(connection_, events_)}) {
      const auto* complete = reinterpret_cast<const xcb_present_complete_notify_event_t*>(event.get());
      const bool is_flip = complete->kind == XCB_PRESENT_COMPLETE_KIND_PIXMAP;
      const Refresh refresh{complete->msc, plausible(complete->ust)};
      if (is_flip) flipped_ = refresh.begin;
      if (is_flip ? serial == 0 : complete->serial == serial) return refresh;
    }
  } while (wait_readable(deadline));
  return std::nullopt;
}

// If the count has already passed, the answer comes at once, with the current refresh.
std::optional<RefreshClock::Refresh> RefreshClock::refresh_at(std::uint64_t count, MonotonicTime deadline) {
  xcb_present_notify_msc(connection_, window_, ++serial_, count, 0, 0);
  xcb_flush(connection_);
  return next_event(serial_, deadline);
}

Result<MonotonicTime> RefreshClock::wait_refresh() {
  auto begin = wait_begin();
  if (!begin) return begin;
  std::this_thread::sleep_until(*begin + period_);
  return *begin + period_;
}

Result<MonotonicTime> RefreshClock::wait_begin() {
  const MonotonicTime swapped = steady_clock::now();
  if (events_ == nullptr) return swapped + period_;
  const auto deadline = swapped + kTimeout;
  const auto now = refresh_at(0, deadline);
  auto next = now ? refresh_at(now->count + 1, deadline) : std::nullopt;
  const auto shown = next;
  for (int i = 0; !flips_ && next && !flipped_ && i < kRefreshesUntilAFlip; ++i) {
    next = refresh_at(next->count + 1, deadline);
  }
  if (!shown) return fail(ErrorCode::kDisconnected, "the monitor does not refresh: check its power and cable");
  if (!flips_) flips_ = flipped_.has_value();
  if (*flips_ && !flipped_) static_cast<void>(next_event(0, deadline));
  return flipped_.value_or(shown->begin);
}

}  // namespace slsd
