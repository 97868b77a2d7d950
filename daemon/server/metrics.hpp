// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "daemon/server/methods.hpp"

namespace slsd {

/// What `metrics` answers: the service, its devices, clients and scans as OpenMetrics text (openmetrics.io, 1.0), of
/// counters, gauges and histograms alone, which Prometheus' older text format has, too: node_exporter reads that.
/// docs/metrics.md lists them.
/// @thread thread-bound to the event loop's
[[nodiscard]] std::string metrics_text(const ServiceState& state);

}  // namespace slsd
