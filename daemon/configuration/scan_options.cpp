// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/configuration/scan_options.hpp"

#include "daemon/configuration/in_range.hpp"

namespace slsd {

Result<> ScanOptions::validate() const {
  if (auto valid = in_range("timeout_ms", timeout_ms, 1, kMaxTimeoutMs); !valid) return valid;
  if (auto valid = in_range("exposure_skew_ms", exposure_skew_ms, 0, 10'000); !valid) return valid;
  if (auto valid = in_range("reopen_first_ms", reopen_first_ms, 1, 60'000); !valid) return valid;
  return in_range("reopen_longest_ms", reopen_longest_ms, reopen_first_ms, 600'000);
}

}  // namespace slsd
