// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/exposition.hpp"

#include <cstddef>

#include <fmt/format.h>

namespace slsd {
namespace {

std::string escaped(std::string_view value) {
  std::string text;
  for (const char letter : value) {
    if (letter == '\\' || letter == '"') text += '\\';
    text += letter == '\n' ? std::string("\\n") : std::string(1, letter);
  }
  return text;
}

}  // namespace

void Exposition::family(std::string_view name, std::string_view type, std::string_view help, std::string_view unit) {
  name_ = name;
  counter_ = type == "counter";
  const std::string of(older_ && counter_ ? fmt::format("{}_total", name) : std::string(name));
  text_ += fmt::format("# HELP {} {}\n# TYPE {} {}\n", of, help, of, type);
  if (!older_ && !unit.empty()) text_ += fmt::format("# UNIT {} {}\n", name, unit);
}

void Exposition::sample(double value, Labels labels) {
  line(counter_ ? "_total" : "", labels, value);
}

void Exposition::one(std::string_view name, std::string_view type, std::string_view help, double value,
                     std::string_view unit) {
  family(name, type, help, unit);
  sample(value);
}

void Exposition::histogram(const Duration& duration, std::string_view label, std::string_view value) {
  std::uint64_t below = 0;
  const bool labelled = !label.empty();
  for (std::size_t i = 0; i < duration.buckets.size(); ++i) {
    below += duration.buckets[i];
    std::string bound = i < kDurationBounds.size() ? fmt::format("{}", kDurationBounds[i]) : "+Inf";
    if (bound.find('.') == std::string::npos && bound != "+Inf") bound += ".0";  // as OpenMetrics writes a bound
    labelled ? line("_bucket", {{label, value}, {"le", bound}}, static_cast<double>(below))
             : line("_bucket", {{"le", bound}}, static_cast<double>(below));
  }
  const double seconds = std::chrono::duration<double>(duration.total).count();
  labelled ? line("_count", {{label, value}}, static_cast<double>(duration.count))
           : line("_count", {}, static_cast<double>(duration.count));
  labelled ? line("_sum", {{label, value}}, seconds) : line("_sum", {}, seconds);
}

void Exposition::line(std::string_view suffix, Labels labels, double value) {
  text_ += name_, text_ += suffix;
  char before = '{';
  for (const auto& [label, of] : labels) {
    text_ += fmt::format("{}{}=\"{}\"", before, label, escaped(of));
    before = ',';
  }
  text_ += fmt::format("{} {}\n", before == ',' ? "}" : "", value);
}

}  // namespace slsd
