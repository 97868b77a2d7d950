// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/session/guide/session_terminal.hpp"

#include <chrono>
#include <sstream>

#include <gmock/gmock.h>

namespace slsd {
namespace {

using namespace std::chrono_literals;

TEST(SessionTerminal, RewritesTheLiveLineAndCutsItToTheTerminal) {
  std::ostringstream out;
  SessionTerminal terminal(out, 8, [] { return MonotonicTime{}; });
  terminal.live("moving, still", "moving");
  terminal.say("taken");
  terminal.say("more");
  EXPECT_EQ(out.str(), "\r\x1b[Kmoving,\r\x1b[Ktaken\nmore\n");
}

TEST(SessionTerminal, WritesIntoAPipeOnlyWhatChanges) {
  std::ostringstream out;
  MonotonicTime now{10s};
  SessionTerminal terminal(out, 0, [&] { return now; });
  terminal.live("moving 1 px", "moving");
  now += 5s;
  terminal.live("moving 2 px", "moving");
  terminal.live("still", "still");
  now += 1s;
  terminal.live("moving 3 px", "moving");
  now += 1s;
  terminal.live("moving 4 px", "moving");
  EXPECT_EQ(out.str(), "moving 1 px\nstill\nmoving 4 px\n");
}

}  // namespace
}  // namespace slsd
