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

/// Shares the event loop's time among the clients. The next turn goes to the client whose total use after it would be
/// smallest. So a client that asks for little does not wait for those that flood. Self-clocked fair queueing (Golestani
/// 1994); the cost of a turn is its processor time, so a long line to parse costs more than a short one. Wall-clock
/// time would charge a client for other programs' turns. Sorting by the start of turns, not their end, would make a
/// client's two quick turns wait for long turns of others.
///
/// A client that leaves the loop to others between its turns is forgiven a sixteenth of that time. Otherwise one of 65
/// clients could use up its share by asking for the status 50 times a second. It would then wait as long as those that
/// flood.
///
///     time     a turn begins at the end of the client's previous turn, but not before now; now is the start of the
///              latest turn, and advances after it by the turn's cost, shared among the waiting clients
///     floods   A |--------|
///              B |--------|
///     status   C |-|-|                  ends first, and is next, twice
///
/// @thread thread-bound
class Turns {
 public:
  /// A client that takes turns. Must outlive the turns that it asks for.
  struct Taker {
    std::chrono::nanoseconds used_until{};
    std::chrono::nanoseconds last_cost{};
    std::optional<std::chrono::nanoseconds> left_at;  ///< time when its last turn ended
    bool asked = false;                               ///< it waits for a turn that has not begun
  };

  using Time = std::chrono::nanoseconds (*)();
  /// The processor time that this thread has used.
  [[nodiscard]] static std::chrono::nanoseconds processor_time();

  /// @param time  replaceable for tests
  explicit Turns(asio::io_context& events, Time time = processor_time) : events_(events), time_(time) {}
  Turns(const Turns&) = delete;
  Turns& operator=(const Turns&) = delete;

  /// Calls a turn later. @param turn  a fraction of a millisecond of work; asks again for more
  /// @param cost  a lower bound of the cost, if known; at least the last turn's cost is expected
  void ask(Taker& taker, std::chrono::nanoseconds cost, std::function<void()> turn);
  /// Forgets all requests.
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
  std::chrono::nanoseconds now_{};                            ///< the earliest start of a turn
};

}  // namespace slsd
