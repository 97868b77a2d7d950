// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/session/guide/session_terminal.hpp"

#include <chrono>

#include <sys/ioctl.h>
#include <unistd.h>

namespace slsd {
namespace {

constexpr std::chrono::seconds kLinePause{2};
constexpr int kColumnsUnknown = 80;
constexpr char kEraseLine[] = "\r\x1b[K";

}  // namespace

int SessionTerminal::columns_of_stdout() {
  if (::isatty(STDOUT_FILENO) == 0) return 0;
  winsize size{};
  const bool known = ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : kColumnsUnknown;
}

void SessionTerminal::live(const std::string& text, const std::string& state) {
  if (columns_ == kNoLive) return;
  if (columns_ > 0) {
    out_ << kEraseLine << text.substr(0, static_cast<std::size_t>(columns_ - 1)) << std::flush;
    live_ = true;
    return;
  }
  if (state == state_ || now_() < next_line_) return;
  state_ = state;
  next_line_ = now_() + kLinePause;
  out_ << text << std::endl;
}

void SessionTerminal::say(const std::string& text) {
  if (live_) out_ << kEraseLine;
  live_ = false;
  out_ << text << std::endl;
}

}  // namespace slsd
