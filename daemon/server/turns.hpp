// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <utility>

#include <asio/io_context.hpp>

namespace slsd {

/// Shares the event loop's time among the clients: next is whoever would have used the least of it after the turn, so
/// that a client that asks for little does not wait for all those who flood. Self-clocked fair queueing (Golestani
/// 1994), with the processor's time that a turn took as its cost: a long line to parse costs more than a short one,
/// whatever is in it. By the clock, who was served when another program had its turn would pay for that. By the start
/// of the turns in the place of their end, two quick ones of a client would wait for a long one of each other.
///
/// Who leaves the loop to others between its turns is forgiven a sixteenth of that time: of 65 clients one that asks
/// for the status 50 times a second would else have used its share up, and waited as long as those who flood.
///
///     time     a turn begins where the client's turn before ended, but not before now; now is the start of the latest
///              turn under way, and goes on by the share that each of those who wait had in it
///     floods   A |--------|
///              B |--------|
///     status   C |-|-|                  ends first, and is next, twice
///
/// @thread thread-bound
class Turns {
 public:
  /// One who takes turns. Outlives those that it asked for.
  struct Taker {
    std::chrono::nanoseconds used_until{};
    std::chrono::nanoseconds last_cost{};
    std::optional<std::chrono::nanoseconds> left_at;  ///< time when its last turn ended
    bool asked = false;                               ///< it waits for a turn that has not begun
  };

  using Time = std::chrono::nanoseconds (*)();
  /// The processor time that this thread has used.
  [[nodiscard]] static std::chrono::nanoseconds processor_time();

  /// @param time  another one is for tests
  explicit Turns(asio::io_context& events, Time time = processor_time) : events_(events), time_(time) {}
  Turns(const Turns&) = delete;
  Turns& operator=(const Turns&) = delete;

  /// Calls later. @param turn  a part of a millisecond of work; one asks again for more
  /// @param cost  what it will take at least, as far as that is known; as much as the last one, too, is expected
  void ask(Taker& taker, std::chrono::nanoseconds cost, std::function<void()> turn);
  /// Forgets who asked.
  void clear();

 private:
  void post_next();
  void take_next();

  struct Waiting {
    Taker* taker;
    std::chrono::nanoseconds start;
    std::function<void()> turn;
  };
  /// The taker whose turn is under way. Its next request waits in the two members below, until the turn's cost is
  /// known.
  Taker* running_ = nullptr;
  std::chrono::nanoseconds again_cost_{};
  std::function<void()> again_;
  asio::io_context& events_;
  Time time_;
  std::multimap<std::chrono::nanoseconds, Waiting> waiting_;  ///< sorted by expected end; equals in the order of asking
  std::chrono::nanoseconds now_{};                            ///< earliest start of a taker's turn
};

}  // namespace slsd
