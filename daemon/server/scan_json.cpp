// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/scan_json.hpp"

#include "daemon/rpc/rpc_error.hpp"

namespace slsd {
namespace {

using nlohmann::json;

double milliseconds(std::chrono::nanoseconds time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

template <class Counts>
json regions_json(const Counts& counts) {
  json regions = json::object();
  for (std::size_t i = 0; i < counts.size(); ++i) {
    regions[std::string(to_string(static_cast<RegionStatus>(i)))] = counts[i];
  }
  return regions;
}

json duration_json(const Duration& duration) {
  return {{"last", milliseconds(duration.last)},
          {"mean", milliseconds(duration.mean())},
          {"longest", milliseconds(duration.longest)}};
}

std::string stage_name(std::size_t index) {
  return std::string(to_string(static_cast<Stage>(index)));
}

}  // namespace

json scan_json(const ScanResult& scan) {
  json stages = json::object();
  for (std::size_t i = 0; i < scan.stage_times.size(); ++i) stages[stage_name(i)] = milliseconds(scan.stage_times[i]);
  return {{"scan", scan.cloud.scan_id},
          {"time", scan.cloud.time},
          {"frame", scan.cloud.frame},
          {"points", scan.cloud.points.size()},
          {"regions", regions_json(scan.regions)},
          {"capture_ms", milliseconds(scan.capture_time)},
          {"decode_ms", milliseconds(scan.decode_time)},
          {"stages_ms", std::move(stages)}};
}

json totals_json(const ScanTotals& totals) {
  json failed = json::object();
  for (const auto& [code, count] : totals.failed) failed[std::string(to_string(code))] = count;
  json stages = json::object();
  for (std::size_t i = 0; i < totals.stages.size(); ++i) stages[stage_name(i)] = duration_json(totals.stages[i]);
  json result{{"succeeded", totals.succeeded},
              {"failed", std::move(failed)},
              {"points_of_last", totals.points},
              {"regions", regions_json(totals.regions)},
              {"regions_of_last", regions_json(totals.regions_of_last)},
              {"capture_ms", duration_json(totals.capture)},
              {"decode_ms", duration_json(totals.decode)},
              {"stages_ms", std::move(stages)}};
  result["last_error"] = totals.last_error ? rpc_error(*totals.last_error).to_json() : json();
  return result;
}

}  // namespace slsd
