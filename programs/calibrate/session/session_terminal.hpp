// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <functional>
#include <ostream>
#include <string>

#include "drivers/camera/frame.hpp"

namespace slsd {

/// The output of a session to a person: lines that stay, and below them one that is rewritten. A pipe or a file gets
/// that one as a line of its own when its state changes, every two seconds at most.
/// @thread thread-bound
class SessionTerminal {
 public:
  /// @param out      outlives this
  /// @param columns  to which the live line is cut; 0: what is written cannot be rewritten; kNoLive: it is left out
  SessionTerminal(std::ostream& out, int columns, std::function<MonotonicTime()> now)
      : out_(out), columns_(columns), now_(std::move(now)) {}

  static constexpr int kNoLive = -1;

  /// The width of the standard output; 0 if it is no terminal.
  [[nodiscard]] static int columns_of_stdout();

  /// @param state  what of the text is worth a line of its own
  void live(const std::string& text, const std::string& state);
  /// Writes one line or more, without the last line's end.
  void say(const std::string& text);

 private:
  std::ostream& out_;
  int columns_;
  std::function<MonotonicTime()> now_;
  std::string state_;
  MonotonicTime next_line_{};
  bool live_ = false;
};

}  // namespace slsd
