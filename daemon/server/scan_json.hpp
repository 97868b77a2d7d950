// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <nlohmann/json.hpp>

#include "daemon/scan/scan_result.hpp"
#include "daemon/scan/scan_statistics.hpp"

namespace slsd {

/// What a client is told of a scan besides its cloud: id, time, number of points, regions by status, times.
[[nodiscard]] nlohmann::json scan_json(const ScanResult& scan);

/// What `status` tells of all scans.
[[nodiscard]] nlohmann::json totals_json(const ScanTotals& totals);

}  // namespace slsd
