// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

namespace slsd {

/// Ends a command at the first SIGINT or SIGTERM after its current step; the second ends the program at once.
/// @thread thread-bound
class Interrupt {
 public:
  /// Starts watching for the signals.
  static void watch();
  [[nodiscard]] static bool came();
};

}  // namespace slsd
