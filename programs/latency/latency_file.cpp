// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/latency/latency_file.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/duration.hpp"
#include "core/toml/table_reader.hpp"

namespace slsd {
namespace {

using std::chrono::microseconds;
using std::filesystem::path;

std::string quoted(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string camera_table(const CameraLatency& camera) {
  return fmt::format(
      "\n[[camera]]\nname = {}\nflashes = {}\nlatency_us = {}\nmedian_us = {}\np05_us = {}\np95_us = {}\nclipped = "
      "{}\n",
      quoted(camera.camera), camera.flashes, camera.latency.count(), camera.median.count(), camera.p05.count(),
      camera.p95.count(), camera.clipped);
}

int read_count(TableReader& reader, const char* key) {
  int count = 0;
  reader.read(key, count);
  if (count < 0) reader.refuse(key, "must not be negative: measure again with slsd --calibrate --latency");
  return count;
}

Result<CameraLatency> read_camera(const toml::table& table, const path& file) {
  TableReader reader(&table, "[[camera]]", file);
  CameraLatency camera;
  reader.read("name", camera.camera);
  camera.flashes = read_count(reader, "flashes");
  camera.latency = microseconds(read_count(reader, "latency_us"));
  camera.median = microseconds(read_count(reader, "median_us"));
  camera.p05 = microseconds(read_count(reader, "p05_us"));
  camera.p95 = microseconds(read_count(reader, "p95_us"));
  reader.read("clipped", camera.clipped);
  if (auto read = reader.finish(); !read) return tl::unexpected(read.error());
  return camera;
}

Result<LatencyReport> read_report(const toml::table& document, const path& file) {
  TableReader top(&document, "", file);
  LatencyReport report;
  top.read("date", report.date);
  top.read("projector", report.projector);
  const std::vector<const toml::table*> cameras = top.tables("camera");
  if (auto read = top.finish(); !read) return tl::unexpected(read.error());
  for (const toml::table* table : cameras) {
    auto camera = read_camera(*table, file);
    if (!camera) return tl::unexpected(camera.error());
    report.cameras.push_back(std::move(*camera));
  }
  return report;
}

}  // namespace

path latency_file(const Configuration& configuration, const path& configuration_file) {
  const path& beside = configuration.calibration_file.empty() ? configuration_file : configuration.calibration_file;
  return beside.parent_path() / "latency.toml";
}

std::string projector_name(const std::string& driver, const std::string& monitor) {
  return monitor.empty() ? driver : driver + " " + monitor;
}

std::vector<std::string> latency_warnings(const Configuration& configuration, const LatencyReport& report,
                                          const std::string& projector) {
  std::vector<std::string> warnings;
  if (!projector.empty() && !report.projector.empty() && projector != report.projector)
    warnings.push_back(fmt::format(
        "the latency was measured with the projector \"{}\", but this one is \"{}\": run slsd --calibrate --latency",
        report.projector, projector));
  for (const CameraOptions& camera : configuration.cameras) {
    const auto measured = std::ranges::find(report.cameras, camera.name(), &CameraLatency::camera);
    if (measured == report.cameras.end()) {
      warnings.push_back(
          fmt::format("camera \"{}\": its latency was not measured: run slsd --calibrate --latency", camera.name()));
      continue;
    }
    if (measured->clipped)
      warnings.push_back(
          fmt::format("camera \"{}\": its latency was measured on overexposed frames, and may be one exposure too "
                      "short: expose less, then run slsd --calibrate --latency",
                      camera.name()));
    const double needed_ms = in_ms(measured->latency);
    if (needed_ms <= configuration.scan.projector_latency_ms) continue;
    warnings.push_back(
        fmt::format("camera \"{}\" saw complete images only {:.1f} ms after they were shown, but [scan] "
                    "projector_latency_ms is {:g}: set {:.0f}",
                    camera.name(), needed_ms, configuration.scan.projector_latency_ms, std::ceil(needed_ms)));
  }
  return warnings;
}

std::string write_latency(const LatencyReport& report) {
  std::string text =
      "# Time from showing an image to the first complete frame of it, measured by\n# slsd --calibrate --latency. "
      "[scan] projector_latency_ms must be at least the largest latency_us.\n";
  text += "date = " + quoted(report.date) + "\nprojector = " + quoted(report.projector) + "\n";
  for (const CameraLatency& camera : report.cameras) text += camera_table(camera);
  return text;
}

Result<LatencyReport> read_latency(std::string_view text, const path& file) {
  try {
    return read_report(toml::parse(text, file.string()), file);
  } catch (const toml::parse_error& error) {
    return fail(ErrorCode::kMalformed, std::string(error.description()), place_of(error.source(), file.string()));
  }
}

}  // namespace slsd
