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

double latency_ms(MonotonicTime received) {
  return milliseconds(std::chrono::steady_clock::now() - received);
}

json scan_json(const ScanResult& scan) {
  json stages = json::object();
  for (std::size_t i = 0; i < scan.stage_times.size(); ++i) stages[stage_name(i)] = milliseconds(scan.stage_times[i]);
  json result{{"scan", scan.cloud.scan_id},
              {"time", scan.cloud.time},
              {"frame", scan.cloud.frame},
              {"points", scan.cloud.points.size()},
              {"regions", regions_json(scan.regions)},
              {"received_monotonic_us",
               std::chrono::duration_cast<std::chrono::microseconds>(scan.received.time_since_epoch()).count()},
              {"skipped", scan.skipped},
              {"skew_ms", milliseconds(scan.skew)},
              {"capture_ms", milliseconds(scan.capture_time)},
              {"decode_ms", milliseconds(scan.decode_time)},
              {"stages_ms", std::move(stages)}};
  if (scan.saturated) result["saturated"] = *scan.saturated;
  result["tries"] = scan.lost.count + 1;
  if (scan.lost.count > 0) {
    json lost = json::array();
    for (const Error& error : scan.lost.last) lost.push_back(rpc_error(error).to_json());
    result["lost_tries"] = std::move(lost);
  }
  return result;
}

json frame_json(const FrameImage& frame) {
  json result{{"width_px", frame.width_px},
              {"height_px", frame.height_px},
              {"bits", frame.bits},
              {"frame", frame.sequence},
              {"exposure_start_ns", frame.exposure_start.time_since_epoch().count()},
              {"received_ns", frame.received.time_since_epoch().count()}};
  if (!frame.camera.empty()) result["camera"] = frame.camera;
  return result;
}

json totals_json(const ScanTotals& totals) {
  json failed = json::object();
  for (const auto& [code, count] : totals.failed) failed[std::string(to_string(code))] = count;
  json stages = json::object();
  for (std::size_t i = 0; i < totals.stages.size(); ++i) stages[stage_name(i)] = duration_json(totals.stages[i]);
  json result{{"succeeded", totals.succeeded},
              {"failed", std::move(failed)},
              {"skipped", totals.skipped},
              {"points_of_last", totals.points},
              {"regions", regions_json(totals.regions)},
              {"regions_of_last", regions_json(totals.regions_of_last)},
              {"capture_ms", duration_json(totals.capture)},
              {"decode_ms", duration_json(totals.decode)},
              {"latency_ms", duration_json(totals.latency)},
              {"stages_ms", std::move(stages)}};
  result["last_error"] = totals.last_error ? rpc_error(*totals.last_error).to_json() : json();
  return result;
}

}  // namespace slsd
