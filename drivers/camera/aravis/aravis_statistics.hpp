// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>

namespace slsd {

/// What became of a camera's frames since open().
struct AravisStatistics {
  std::uint64_t delivered = 0;   ///< handed out
  std::uint64_t lost = 0;        ///< by the gaps of the frame identifiers: never came, or torn
  std::uint64_t torn = 0;        ///< came with holes, too short, of another size, or with broken chunks
  std::uint64_t stale = 0;       ///< exposed before they were asked for, and passed over
  std::uint64_t misexposed = 0;  ///< of another exposure or gain than configured, by their chunks
  std::uint64_t packets_sent_again = 0;
  std::uint64_t packets_missing = 0;
};

}  // namespace slsd
