// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

namespace slsd {

/// Counts frames that are missing between those delivered and that no error has told of.
/// @thread thread-bound
class SequenceGaps {
 public:
  /// The device counts anew.
  void restart() { *this = {}; }
  /// A frame was told to be lost.
  void note_failure() { ++failures_; }
  /// @return how many frames before this one were lost without an error
  [[nodiscard]] std::uint64_t note_frame(std::uint64_t sequence) {
    const std::uint64_t missing = last_ && sequence > *last_ ? sequence - *last_ - 1 : 0;
    const std::uint64_t told = std::min(missing, failures_);
    last_ = sequence;
    failures_ = 0;
    return missing - told;
  }

 private:
  std::optional<std::uint64_t> last_;
  std::uint64_t failures_ = 0;
};

}  // namespace slsd
