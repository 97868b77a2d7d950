// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/scan_statistics.hpp"

namespace slsd {

void ScanStatistics::note_latency(std::chrono::nanoseconds time) {
  const std::lock_guard lock(mutex_);
  totals_.latency.add(time);
}

void ScanStatistics::note(const Result<ScanResult>& scan, std::uint64_t skipped) {
  const std::lock_guard lock(mutex_);
  totals_.skipped += skipped;
  if (!scan) {
    ++totals_.failed[scan.error().code];
    totals_.last_error = scan.error();
    return;
  }
  ++totals_.succeeded;
  totals_.points = scan->cloud.points.size();
  totals_.empty = scan->empty;
  totals_.all_points += totals_.points;
  totals_.lost_tries += scan->lost.count;
  totals_.regions_of_last = scan->regions;
  for (std::size_t i = 0; i < scan->regions.size(); ++i) totals_.regions[i] += scan->regions[i];
  totals_.rules_of_last = scan->rules;
  for (std::size_t i = 0; i < scan->rules.size(); ++i) totals_.rules[i] += scan->rules[i];
  if (!scan->light.empty()) totals_.light = scan->light;
  totals_.capture.add(scan->capture_time);
  totals_.decode.add(scan->decode_time);
  for (std::size_t i = 0; i < scan->stage_times.size(); ++i) totals_.stages[i].add(scan->stage_times[i]);
  if (!scan->dense) return;
  totals_.dense.add(scan->dense_time);
  for (const DenseView& view : scan->dense->views) {
    for (std::size_t i = 0; i < totals_.pixels.size(); ++i) totals_.pixels[i] += view.map.counts[i];
  }
}

ScanTotals ScanStatistics::totals() const {
  const std::lock_guard lock(mutex_);
  return totals_;
}

}  // namespace slsd
