// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/methods/metrics.hpp"

#include <string_view>
#include <utility>

#include "daemon/scan/scan_statistics.hpp"
#include "daemon/server/methods/status_json.hpp"

namespace slsd {
namespace {

void tell_service(const ServiceState& state, Exposition& out) {
  const auto uptime = std::chrono::duration<double>(std::chrono::steady_clock::now() - state.started);
  out.family("slsd_build", "gauge", "Always 1; its label has the version of the service.");
  out.sample(1, {{"version", SLSD_VERSION}});
  out.one("slsd_uptime_seconds", "gauge", "Time since the service started.", uptime.count(), "seconds");
  out.one("slsd_ready", "gauge", "1 if all devices are open and there is a calibration.", is_ready(state) ? 1 : 0);
  out.one("slsd_resident_bytes", "gauge", "Resident memory of the service.", static_cast<double>(resident_bytes()),
          "bytes");
  out.one("slsd_log_lines_dropped", "counter", "Lines of the log that were dropped because nothing read them in time.",
          static_cast<double>(state.log_lines_dropped()));
}

void tell_black_box(const ServiceState& state, Exposition& out) {
  out.one("slsd_black_box_bytes", "gauge", "Memory that holds the last scans.",
          static_cast<double>(state.scanner.black_box().bytes()), "bytes");
  out.one("slsd_bundles_written", "counter", "Bundles that the service wrote because a scan failed in a new way.",
          static_cast<double>(state.bundles_written()));
}

void tell_clients(const ServiceState& state, Exposition& out) {
  const Server& server = *state.server;
  const Traffic& traffic = server.traffic();
  const auto count = [&](std::string_view name, std::string_view help, std::uint64_t value,
                         std::string_view unit = {}) {
    out.one(name, "counter", help, static_cast<double>(value), unit);
  };
  out.one("slsd_clients", "gauge", "Connected clients.", static_cast<double>(server.clients()));
  out.one("slsd_subscribers", "gauge", "Connected clients that subscribe to clouds.",
          static_cast<double>(server.subscribers()));
  count("slsd_clients_accepted", "Clients that have connected.", traffic.accepted);
  count("slsd_clients_refused", "Clients refused because all places were taken, or for lack of a role.",
        traffic.refused);
  count("slsd_clients_dropped", "Clients dropped because they read too slowly.", traffic.dropped);
  count("slsd_received_bytes", "Bytes received in requests.", traffic.bytes_received, "bytes");
  count("slsd_sent_bytes", "Bytes sent in replies and events, without memfds.", traffic.bytes_sent, "bytes");
  count("slsd_clouds_lost", "Clouds that subscribers lost because they read too slowly.", traffic.clouds_lost);
  const MemoryBudget& memory = server.memory();
  out.family("slsd_clients_memory_bytes", "gauge",
             "Memory of replies that clients have not read: held, lent as memfds, and the limit.", "bytes");
  out.sample(static_cast<double>(memory.held()), {{"part", "held"}});
  out.sample(static_cast<double>(memory.lent()), {{"part", "lent"}});
  out.sample(static_cast<double>(memory.limit()), {{"part", "limit"}});
  out.family("slsd_requests", "counter", "Requests, by method.");
  for (const auto& [method, asked] : state.requests.by_method)
    out.sample(static_cast<double>(asked), {{"method", method}});
  out.family("slsd_requests_failed", "counter", "Requests answered with an error, by its name.");
  for (const auto& [name, failed] : state.requests.failed) out.sample(static_cast<double>(failed), {{"error", name}});
}

constexpr DeviceState kStates[] = {DeviceState::kAbsent, DeviceState::kOpening, DeviceState::kReady,
                                   DeviceState::kCapturing, DeviceState::kFaulted};

void tell_cameras(const ServiceState& state, Exposition& out) {
  const std::vector<DeviceStatus> cameras = state.scanner.rig().camera_statuses();
  out.family("slsd_camera_state", "gauge", "1 for the camera's current state, 0 for the others.");
  for (const DeviceStatus& camera : cameras) {
    for (const DeviceState each : kStates)
      out.sample(camera.state == each ? 1 : 0, {{"camera", camera.name}, {"state", to_string(each)}});
  }
  const auto count = [&](std::string_view name, std::string_view help, auto value_of) {
    out.family(name, "counter", help);
    for (const DeviceStatus& camera : cameras)
      out.sample(static_cast<double>(value_of(camera)), {{"camera", camera.name}});
  };
  count("slsd_camera_frames", "Frames delivered.", [](const DeviceStatus& camera) { return camera.frames; });
  count("slsd_camera_reconnects", "Times the camera was reopened after it was lost.",
        [](const DeviceStatus& camera) { return camera.opened > 0 ? camera.opened - 1 : 0; });
  out.family("slsd_camera_frames_lost", "counter",
             "Frames requested but not delivered, by error; \"missing\": gaps between delivered frames.");
  for (const DeviceStatus& camera : cameras) {
    std::uint64_t missing = camera.frames_lost;
    for (const auto& [code, failed] : camera.frames_failed) {
      out.sample(static_cast<double>(failed), {{"camera", camera.name}, {"cause", to_string(code)}});
      missing -= failed;
    }
    out.sample(static_cast<double>(missing), {{"camera", camera.name}, {"cause", "missing"}});
  }
  for (const bool counts : {true, false}) {
    counts ? out.family("slsd_camera_driver", "counter", "Counters of the camera's driver since it opened the camera.")
           : out.family("slsd_camera_driver_now", "gauge", "Current values that the camera's driver reports.");
    for (const DeviceStatus& camera : cameras) {
      for (const DriverFigure& figure : camera.figures) {
        if (figure.counts == counts)
          out.sample(figure.value, {{"camera", camera.name}, {"driver", camera.driver}, {"figure", figure.name}});
      }
    }
  }
  const std::vector<DriftState> drifts = state.scanner.drifts();
  const auto drift = [&](std::string_view name, std::string_view help, auto value_of, std::string_view unit) {
    out.family(name, "gauge", help, unit);
    for (std::size_t i = 0; i < std::min(drifts.size(), cameras.size()); ++i)
      out.sample(value_of(drifts[i]), {{"camera", cameras[i].name}});
  };
  drift(
      "slsd_camera_epipolar_px", "Distance of recent scans' points from their epipolar lines.",
      [](const DriftState& of) { return of.epipolar_px; }, "px");
  drift(
      "slsd_camera_epipolar_limit_px",
      "Limit of slsd_camera_epipolar_px: above it the camera does not match its calibration.",
      [](const DriftState& of) { return of.limit_px; }, "px");
  drift("slsd_camera_knocked", "1 if the camera was knocked out of its calibration.",
        [](const DriftState& of) { return of.off_since_scan ? 1.0 : 0.0; }, {});
}

void tell_projector(const ServiceState& state, Exposition& out) {
  const DeviceStatus projector = state.scanner.rig().projector_status();
  out.family("slsd_projector_state", "gauge", "1 for the projector's current state, 0 for the others.");
  for (const DeviceState each : kStates) out.sample(projector.state == each ? 1 : 0, {{"state", to_string(each)}});
  out.one("slsd_projector_reconnects", "counter", "Times the projector was reopened after it was lost.",
          static_cast<double>(projector.opened > 0 ? projector.opened - 1 : 0));
}

void tell_scans(const ServiceState& state, Exposition& out) {
  const ScanTotals totals = state.scanner.totals();
  const auto count = [&](std::string_view name, std::string_view help, std::uint64_t value) {
    out.one(name, "counter", help, static_cast<double>(value));
  };
  count("slsd_scans_succeeded", "Scans that gave a cloud.", totals.succeeded);
  out.family("slsd_scans_failed", "counter", "Scans that failed, by the error's name.");
  for (const auto& [code, failed] : totals.failed)
    out.sample(static_cast<double>(failed), {{"error", to_string(code)}});
  count("slsd_scans_skipped", "Sets of frames that were not decoded because newer ones arrived.", totals.skipped);
  count("slsd_scan_tries_lost", "Attempts that lost their frames, in scans that later succeeded.", totals.lost_tries);
  count("slsd_points", "Symbol points in all clouds.", totals.all_points);
  out.one("slsd_points_of_last_scan", "gauge", "Symbol points in the last cloud.", static_cast<double>(totals.points));
  out.family("slsd_regions", "counter", "Regions of all frames, by status: decoded, or the reason for rejection.");
  for (std::size_t i = 0; i < totals.regions.size(); ++i)
    out.sample(static_cast<double>(totals.regions[i]), {{"status", to_string(static_cast<RegionStatus>(i))}});
  out.family("slsd_regions_by_rule", "counter",
             "Regions of all frames, by the rule that decided; guards kept rejected regions from recovery.");
  for (std::size_t i = 0; i < totals.rules.size(); ++i)
    out.sample(static_cast<double>(totals.rules[i]),
               {{"rule", to_string(decode_rule(i))}, {"kind", to_string(text_of(decode_rule(i)).kind)}});
  const auto light = [&](std::string_view name, std::string_view help, std::optional<float> SymbolLight::*figure,
                         std::string_view unit = {}) {
    out.family(name, "gauge", help, unit);
    for (const auto& [camera, seen] : totals.light)
      if (seen.*figure) out.sample(*(seen.*figure), {{"camera", camera}});
  };
  light("slsd_camera_clipped_share", "Share of the last scan's decoded symbols that are saturated, or nearly.",
        &SymbolLight::clipped_share);
  light("slsd_camera_edge_px", "Blur at the sharpest edges of the last scan's frame, one standard deviation.",
        &SymbolLight::edge_px, "px");
  out.family("slsd_pixels", "counter", "Pixels of all dense clouds, by status: measured, or the reason why not.");
  for (std::size_t i = 0; i < totals.pixels.size(); ++i)
    out.sample(static_cast<double>(totals.pixels[i]), {{"status", to_string(static_cast<DensePixel>(i))}});
  const auto times = [&](std::string_view name, std::string_view help, const Duration& duration) {
    out.family(name, "histogram", help, "seconds");
    out.histogram(duration);
  };
  times("slsd_capture_seconds", "Time from a scan's turn to its last frame.", totals.capture);
  times("slsd_decode_seconds", "Time from a scan's last frame to its cloud.", totals.decode);
  times("slsd_dense_seconds", "Part of the decoding time that dense points took.", totals.dense);
  times("slsd_latency_seconds", "Time from the last byte of a scan's frames to its cloud at a client's socket.",
        totals.latency);
  out.family("slsd_stage_seconds", "histogram", "Time of each decoding stage.", "seconds");
  for (std::size_t i = 0; i < totals.stages.size(); ++i)
    out.histogram(totals.stages[i], "stage", to_string(static_cast<Stage>(i)));
}

}  // namespace

std::string metrics_text(const ServiceState& state, MetricsFormat format) {
  Exposition out(format);
  tell_service(state, out);
  tell_scans(state, out);
  tell_projector(state, out);
  tell_cameras(state, out);
  tell_clients(state, out);
  tell_black_box(state, out);
  return std::move(out).finish();
}

}  // namespace slsd
