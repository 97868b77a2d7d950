// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "core/exposition.hpp"
#include "daemon/server/service_state.hpp"

namespace slsd {

/// The answer to `metrics`: the service, its devices, clients and scans. docs/metrics.md lists the metrics.
/// @thread thread-bound to the event loop's
[[nodiscard]] std::string metrics_text(const ServiceState& state, MetricsFormat format = MetricsFormat::kOpenMetrics);

}  // namespace slsd
