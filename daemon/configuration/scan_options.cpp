// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/configuration/scan_options.hpp"

#include "daemon/configuration/in_range.hpp"

namespace slsd {

Result<> ScanOptions::validate() const {
  if (auto valid = in_range("timeout_ms", timeout_ms, 1, kMaxTimeoutMs); !valid) return valid;
  if (auto valid = in_range("exposure_skew_ms", exposure_skew_ms, 0, 10'000); !valid) return valid;
  if (auto valid = in_range("reopen_first_ms", reopen_first_ms, 1, 60'000); !valid) return valid;
  if (auto valid = in_range("reopen_longest_ms", reopen_longest_ms, reopen_first_ms, 600'000); !valid) return valid;
  if (!(projector_latency_ms >= 0 && projector_latency_ms <= 1000)) {
    return fail(ErrorCode::kInvalidArgument, "projector_latency_ms must be 0 to 1000");
  }
  if (power_line_hz == 0 || power_line_hz == 50 || power_line_hz == 60) return {};
  return fail(ErrorCode::kInvalidArgument, "power_line_hz must be 50, 60, or 0 where no lamps are near");
}

}  // namespace slsd
