// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

namespace slsd {

/// Lets the first SIGINT or SIGTERM end a command after the step under way; the second ends the program at once.
/// @thread thread-bound
class Interrupt {
 public:
  /// Watches for the signals from now on.
  static void watch();
  [[nodiscard]] static bool came();
};

}  // namespace slsd
