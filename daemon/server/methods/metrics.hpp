// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

#include "daemon/server/service_state.hpp"

namespace slsd {

/// OpenMetrics 1.0 (openmetrics.io), or the older text format of Prometheus (0.0.4), which node_exporter reads. In the
/// older format, a counter's type and help name it with "_total".
enum class MetricsFormat { kOpenMetrics, kPrometheus };

/// The answer to `metrics`: the service, its devices, clients and scans. docs/metrics.md lists the metrics.
/// @thread thread-bound to the event loop's
[[nodiscard]] std::string metrics_text(const ServiceState& state, MetricsFormat format = MetricsFormat::kOpenMetrics);

}  // namespace slsd
