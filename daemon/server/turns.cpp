// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/turns.hpp"

#include <ctime>

#include <algorithm>

#include <asio/post.hpp>

namespace slsd {
namespace {

constexpr int kForgiven = 16;  // fraction of the time that a client left to others

}  // namespace

std::chrono::nanoseconds Turns::processor_time() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

void Turns::ask(Taker& taker, std::chrono::nanoseconds cost, std::function<void()> turn) {
  taker.asked = true;
  if (&taker == running_) {
    again_cost_ = cost;
    again_ = std::move(turn);
    return;
  }
  const auto forgiven = taker.left_at ? (time_() - *taker.left_at) / kForgiven : std::chrono::nanoseconds(0);
  const auto start = std::max(taker.used_until, now_);
  const auto end = start + std::max(cost, taker.last_cost);
  waiting_.emplace(std::max(end - forgiven, now_), Waiting{&taker, std::max(start - forgiven, now_), std::move(turn)});
  if (waiting_.size() == 1) post_next();
}

// Gives the turn in another round of the event loop. So requests made during a turn count before the next turn is
// given.
void Turns::post_next() {
  asio::post(events_, [this] { asio::post(events_, [this] { take_next(); }); });
}

// Gives one turn in each round of the event loop, so that its other work comes in between.
void Turns::take_next() {
  if (waiting_.empty()) return;
  auto next = waiting_.extract(waiting_.begin());
  if (!waiting_.empty()) post_next();
  auto& [taker, start, turn] = next.mapped();
  now_ = std::max(now_, start);
  const auto begin = time_();
  taker->asked = false;
  running_ = taker;
  turn();
  running_ = nullptr;
  taker->left_at = time_();
  taker->last_cost = *taker->left_at - begin;
  taker->used_until = start + taker->last_cost;
  now_ += taker->last_cost / static_cast<std::int64_t>(waiting_.size() + 1);
  if (again_) ask(*taker, again_cost_, std::exchange(again_, nullptr));
}

void Turns::clear() {
  waiting_.clear();
  again_ = nullptr;
}

}  // namespace slsd
