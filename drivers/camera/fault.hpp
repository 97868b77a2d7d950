// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace slsd {

/// The faults of real cameras.
enum class FaultKind {
  kDrop,        ///< the frame is lost: kFrameDropped, and a gap in the sequence numbers
  kTear,        ///< a part of the frame is missing: kFrameTorn
  kLate,        ///< the frame arrives `duration` late (without one: never): kFrameLate if that is past its deadline
  kStale,       ///< the frame was exposed `duration` before the trigger (100 ms); its exposure_start() shows it
  kStall,       ///< no frame arrives for `duration` (without one: until open()): kFrameLate for shorter waits
  kHang,        ///< the driver does not return for `duration` (without one: never), even if cancelled
  kDisconnect,  ///< the device disappears: kDisconnected, also from open() for `duration` (0 s)
};

/// One fault, at one capture.
struct Fault {
  FaultKind kind = FaultKind::kDrop;
  std::uint64_t capture = 1;  ///< the capture() that fails, counted from 1 over the camera's life
  std::optional<std::chrono::nanoseconds> duration;

  friend bool operator==(const Fault&, const Fault&) = default;
};

/// Reads a fault in the form of the configuration: KIND@CAPTURE or KIND@CAPTURE:DURATION. KIND is drop, tear, late,
/// stale, stall, hang or disconnect; DURATION is a number and us, ms or s: "drop@3", "late@5:200ms",
/// "disconnect@7:1.5s".
/// @errors kInvalidArgument
/// @thread reentrant
[[nodiscard]] Result<Fault> parse_fault(std::string_view text);

/// Reads a list of faults; the error names the entry. @errors kInvalidArgument @thread reentrant
[[nodiscard]] Result<std::vector<Fault>> parse_faults(const std::vector<std::string>& texts);

}  // namespace slsd
