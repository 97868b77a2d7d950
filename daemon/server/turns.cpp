// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/turns.hpp"

#include <ctime>

#include <algorithm>

#include <asio/post.hpp>

namespace slsd {

std::chrono::nanoseconds Turns::processor_time() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

void Turns::ask(Taker& taker, std::function<void()> turn) {
  taker.asked = true;
  const bool was_away = taker.used_until < now_;
  waiting_.emplace(Start{std::max(taker.used_until, now_), !was_away}, Waiting{&taker, std::move(turn)});
  if (waiting_.size() == 1) asio::post(events_, [this] { take_next(); });
}

// One turn to a round of the event loop: what else it has to do comes in between.
void Turns::take_next() {
  if (waiting_.empty()) return;
  auto next = waiting_.extract(waiting_.begin());
  if (!waiting_.empty()) asio::post(events_, [this] { take_next(); });
  now_ = next.key().first;
  const auto begin = time_();
  auto& [taker, turn] = next.mapped();
  taker->asked = false;
  turn();
  taker->used_until = now_ + (time_() - begin);
}

}  // namespace slsd
