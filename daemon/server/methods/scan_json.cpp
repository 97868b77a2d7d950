// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/methods/scan_json.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "core/duration.hpp"
#include "core/geometry/robot_pose.hpp"
#include "daemon/server/methods/counts_json.hpp"
#include "rpc/message.hpp"

namespace slsd {
namespace {

using nlohmann::json;

double rounded(double value) {
  return std::round(1e4 * value) / 1e4;
}

void add_pixels(const DenseCloud& dense, const ScanResult& scan, json& result) {
  result["density"] = to_string(Density::kPixels);
  result["width_px"] = dense.views.front().map.width;
  result["height_px"] = dense.views.front().map.height;
  result["points"] = dense.points();
  result["dense_ms"] = in_ms(scan.dense_time);
  if (scan.dense_saturated) result["saturated"] = *scan.dense_saturated;
  if (scan.dense_unseen) result["unseen"] = *scan.dense_unseen;
  json pixels = json::object();
  for (int i = 0; i < kDensePixelCount; ++i) {
    std::uint64_t count = 0;
    for (const DenseView& view : dense.views) count += view.map.counts[static_cast<std::size_t>(i)];
    pixels[std::string(to_string(static_cast<DensePixel>(i)))] = count;
  }
  result["pixels"] = std::move(pixels);
  json epipolar = json::array();
  double white_differs = 0;
  for (const DenseView& view : dense.views) {
    epipolar.push_back(rounded(view.epipolar_px));
    white_differs = std::max(white_differs, view.white_differs);
  }
  result["epipolar_px"] = std::move(epipolar);
  if (scan.dense_saturated) result["white_differs"] = rounded(white_differs);
  if (dense.points() > 0) return;
  result["empty"] = !scan.empty.empty()
                        ? scan.empty
                        : "symbols were decoded, but no surface around them fits the pattern: \"pixels\" has the "
                          "reasons; check depth_min_mm, depth_max_mm and the calibration";
}

// By camera: the number of exposures in its frames, and why not two.
json exposures_json(const std::vector<MergedCamera>& cameras) {
  json result = json::object();
  for (const MergedCamera& camera : cameras) {
    json& about = result[camera.name] = {{"merged", camera.problem.empty() ? 2 : 1}};
    if (!camera.problem.empty()) about["problem"] = camera.problem;
  }
  return result;
}

// By camera, as far as it was measured.
json light_json(const std::vector<CameraLight>& cameras) {
  json result = json::object();
  for (const auto& [name, light] : cameras) {
    json& about = result[name] = json::object();
    if (light.clipped_share) about["clipped_share"] = rounded(*light.clipped_share);
    if (light.edge_px) about["edge_px"] = rounded(*light.edge_px);
  }
  return result;
}

// A 4x4 matrix row by row, mm.
json matrix_json(const RigidTransform& transform) {
  return robot_numbers(transform, {TurnNumbers::kMatrix, /*unit_mm=*/1, /*unit_rad=*/1});
}

}  // namespace

double latency_ms(MonotonicTime received) {
  return in_ms(std::chrono::steady_clock::now() - received);
}

json scan_json(const ScanResult& scan, Density density) {
  json stages = json::object();
  for (std::size_t i = 0; i < scan.stage_times.size(); ++i) stages[stage_name(i)] = in_ms(scan.stage_times[i]);
  json result{{"scan", scan.cloud.scan_id},
              {"time", scan.cloud.time},
              {"time_ns", std::chrono::nanoseconds(scan.exposed.time_since_epoch()).count()},
              {"frame", scan.cloud.frame},
              {"points", scan.cloud.points.size()},
              {"regions", regions_json(scan.regions)},
              {"rules", rules_json(scan.rules)},
              {"received_monotonic_us",
               std::chrono::duration_cast<std::chrono::microseconds>(scan.received.time_since_epoch()).count()},
              {"skipped", scan.skipped},
              {"skew_ms", in_ms(scan.skew)},
              {"capture_ms", in_ms(scan.capture_time)},
              {"decode_ms", in_ms(scan.decode_time)},
              {"stages_ms", std::move(stages)}};
  if (scan.cloud.sigma_calibration_mm) result["sigma_calibration_mm"] = *scan.cloud.sigma_calibration_mm;
  if (scan.saturated) result["saturated"] = *scan.saturated;
  if (scan.unseen) result["unseen"] = *scan.unseen;
  if (density == Density::kPixels && scan.dense) {
    add_pixels(*scan.dense, scan, result);
  } else if (!scan.empty.empty()) {
    result["empty"] = scan.empty;
  }
  if (scan.flange_from_rig) result["flange_from_rig"] = matrix_json(*scan.flange_from_rig);
  if (!scan.light.empty()) result["light"] = light_json(scan.light);
  for (const auto& [name, gains] : scan.white_balance)
    result["white_balance"][name] = {rounded(gains[0]), rounded(gains[1]), rounded(gains[2])};
  if (!scan.merged.empty()) result["exposures"] = exposures_json(scan.merged);
  result["tries"] = scan.lost.count + 1;
  if (scan.lost.count > 0) {
    json lost = json::array();
    for (const Error& error : scan.lost.last) lost.push_back(rpc_error(error).to_json());
    result["lost_tries"] = std::move(lost);
  }
  return result;
}

void add_frame(json& about, const RigidTransform* base_from_rig) {
  if (base_from_rig != nullptr) about["base_from_rig"] = matrix_json(*base_from_rig);
}

json reasons_json(const ScanResult& scan) {
  std::vector<DecodeRule> rules;
  const auto count = [&](DecodeRule rule) { return scan.rules[static_cast<std::size_t>(rule)]; };
  for (std::size_t i = 0; i < kDecodeRuleCount; ++i)
    if (scan.rules[i] > 0 && text_of(decode_rule(i)).kind != RuleKind::kAccepts) rules.push_back(decode_rule(i));
  std::ranges::stable_sort(rules, std::greater(), count);
  json reasons = json::array();
  for (const DecodeRule rule : rules) {
    const RuleText& text = text_of(rule);
    json reason{{"rule", text.name},      {"number", number_of(rule)}, {"kind", to_string(text.kind)},
                {"regions", count(rule)}, {"meaning", text.meaning},   {"remedy", text.remedy}};
    if (text.kind == RuleKind::kRejects) reason["status"] = to_string(text.gives);
    reasons.push_back(std::move(reason));
  }
  return reasons;
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

}  // namespace slsd
