// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <utility>

#include <asio/io_context.hpp>

namespace slsd {

/// Shares the event loop's time among the clients: whoever used the least of it is served next, so that a client that
/// asks for little does not wait for all those who flood. Start-time fair queueing (Goyal, Vin and Cheng 1997), with
/// the processor's time that a turn took as its cost: a long line to parse costs more than a short one, whatever is in
/// it. By the clock, who was served when another program had its turn would pay for that.
///
///     time     a turn begins at its start: the end of the client's turn before, but not before the turn under way
///     floods   A |----|    |----|    |----|
///              B      |----|    |----|    |----|
///     status   C               x|-|                 is next, however many flood
///
/// @thread thread-bound
class Turns {
 public:
  /// One who takes turns. Outlives those that it asked for.
  struct Taker {
    std::chrono::nanoseconds used_until{};
    bool asked = false;  ///< for a turn that has not begun
  };

  using Time = std::chrono::nanoseconds (*)();
  /// Of the processor, that this thread had.
  [[nodiscard]] static std::chrono::nanoseconds processor_time();

  /// @param time  another one is for tests
  explicit Turns(asio::io_context& events, Time time = processor_time) : events_(events), time_(time) {}
  Turns(const Turns&) = delete;
  Turns& operator=(const Turns&) = delete;

  /// Calls later. @param turn  a part of a millisecond of work; one asks again for more
  void ask(Taker& taker, std::function<void()> turn);
  /// Forgets who asked.
  void clear() { waiting_.clear(); }

 private:
  void take_next();

  struct Waiting {
    Taker* taker;
    std::function<void()> turn;
  };
  using Start = std::pair<std::chrono::nanoseconds, bool>;  ///< who used nothing since goes before who did
  asio::io_context& events_;
  Time time_;
  std::multimap<Start, Waiting> waiting_;  ///< equals in the order of asking
  std::chrono::nanoseconds now_{};         ///< the start of the turn under way, or of the last one
};

}  // namespace slsd
