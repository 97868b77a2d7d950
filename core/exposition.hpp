// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

#include "core/duration.hpp"

namespace slsd {

/// OpenMetrics 1.0 (openmetrics.io), or the older text format of Prometheus (0.0.4), which node_exporter reads. In the
/// older format, a counter's type and help name it with "_total".
enum class MetricsFormat : std::uint8_t { kOpenMetrics, kPrometheus };

/// Writes metric families one after another.
/// @thread thread-bound
class Exposition {
 public:
  /// Names of labels and their values.
  using Labels = std::initializer_list<std::pair<std::string_view, std::string_view>>;

  explicit Exposition(MetricsFormat format) : older_(format == MetricsFormat::kPrometheus) {}

  /// Begins a family. @param name  ends with "_" and the unit, if there is one
  void family(std::string_view name, std::string_view type, std::string_view help, std::string_view unit = {});
  /// A sample of the family.
  void sample(double value, Labels labels = {});
  /// A family of one sample.
  void one(std::string_view name, std::string_view type, std::string_view help, double value,
           std::string_view unit = {});
  /// A histogram of the family, in seconds.
  void histogram(const Duration& duration, std::string_view label = {}, std::string_view value = {});

  [[nodiscard]] std::string finish() && { return std::move(text_) + (older_ ? "" : "# EOF\n"); }

 private:
  void line(std::string_view suffix, Labels labels, double value);

  std::string text_;
  std::string name_;
  bool counter_ = false;
  bool older_ = false;
};

}  // namespace slsd
