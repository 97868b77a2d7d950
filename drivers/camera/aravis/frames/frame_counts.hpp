// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <optional>

namespace slsd {

/// Follows a camera's frame identifiers and counts the frames missing between two. Identifiers of 16 bits wrap from
/// 65535 to 1; those of 64 bits never wrap.
/// @thread thread-bound
class FrameIds {
 public:
  /// Returns the number of frames missing between the previous identifier and this one. 0 for the first, and if the
  /// identifiers go back.
  std::uint64_t note(std::uint64_t id) {
    const std::uint64_t before = last_.value_or(id);
    const bool first = !last_.has_value();
    last_ = id;
    if (first || id == before) return 0;
    if (id > before) return id - before - 1;
    const bool wrapped = before <= kLastOf16 && before - id > kLastOf16 / 2;
    return wrapped ? kLastOf16 - before + (id > 0 ? id - 1 : 0) : 0;  // a camera that uses 0 misses no frame there
  }

  void forget() { last_.reset(); }

 private:
  static constexpr std::uint64_t kLastOf16 = 65535;

  std::optional<std::uint64_t> last_;
};

/// The counts of a camera's frames since open().
struct AravisStatistics {
  std::uint64_t delivered = 0;   ///< frames delivered
  std::uint64_t lost = 0;        ///< frames that never arrived or were torn, from gaps in the identifiers
  std::uint64_t torn = 0;        ///< frames with holes, too short, of another size, or with broken chunks
  std::uint64_t stale = 0;       ///< frames skipped because they were exposed before the request
  std::uint64_t misexposed = 0;  ///< frames whose chunks show another exposure or gain than configured
  std::uint64_t packets_sent_again = 0;
  std::uint64_t packets_missing = 0;
  std::uint64_t underruns = 0;  ///< frames that arrived while no buffer was free
};

}  // namespace slsd
