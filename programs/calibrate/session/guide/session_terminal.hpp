// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <functional>
#include <ostream>
#include <string>

#include "drivers/camera/frame.hpp"

namespace slsd {

/// A session's output for a person: permanent lines, and below them a live line that is rewritten. In a pipe or a file,
/// the live line becomes a new line when its state changes, at most every two seconds.
/// @thread thread-bound
class SessionTerminal {
 public:
  /// @param out      must outlive this object
  /// @param columns  the live line is cut to this; 0: lines cannot be rewritten; kNoLive: omit the live line
  SessionTerminal(std::ostream& out, int columns, std::function<MonotonicTime()> now)
      : out_(out), columns_(columns), now_(std::move(now)) {}

  static constexpr int kNoLive = -1;

  /// The width of standard output; 0 if it is not a terminal.
  [[nodiscard]] static int columns_of_stdout();

  /// @param state  the part of the text whose change deserves a new line
  void live(const std::string& text, const std::string& state);
  /// Writes one or more lines; the last without its line end.
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
