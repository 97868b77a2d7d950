// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <chrono>
#include <iostream>

#include <fmt/format.h>

#include "core/duration.hpp"
#include "core/utc_text.hpp"
#include "daemon/configuration/configuration.hpp"
#include "daemon/scan/rig/devices.hpp"
#include "drivers/files/file.hpp"
#include "programs/commands/commands.hpp"
#include "programs/latency/latency_file.hpp"
#include "programs/latency/measure_latency.hpp"

namespace slsd {
namespace {

using std::filesystem::path;

constexpr auto kOpenTime = std::chrono::seconds(30);

void print(const CameraLatency& camera) {
  std::cout << fmt::format(
                   "camera \"{}\": first complete frame {:.1f} ms after the image was shown (5 to 95 % of {} flashes: "
                   "{:.1f} to {:.1f} ms); every frame that began {:.1f} ms later was complete\n",
                   camera.camera, in_ms(camera.median), camera.flashes, in_ms(camera.p05), in_ms(camera.p95),
                   in_ms(camera.latency))
            << std::flush;
}

Result<LatencyReport> measure(const Configuration& configuration, const LatencyOptions& options) {
  auto projector = make_projector(configuration.projector);
  if (!projector) return tl::unexpected(projector.error());
  if (auto opened = (*projector)->open(std::chrono::steady_clock::now() + kOpenTime); !opened)
    return tl::unexpected(opened.error());
  const ProjectorDescription& description = (*projector)->description();
  LatencyReport report{
      utc_text(std::chrono::system_clock::now()), projector_name(description.driver, description.monitor), {}};
  for (const CameraOptions& camera_options : configuration.cameras) {
    auto camera = make_camera(camera_options);
    if (!camera) return tl::unexpected(camera.error());
    if (auto opened = (*camera)->open(); !opened) return tl::unexpected(opened.error());
    auto latency = measure_latency(**projector, **camera, options);
    if (!latency) {
      Error error = latency.error();
      if (error.where.empty()) error.where = "camera " + camera_options.name();
      return tl::unexpected(std::move(error));
    }
    print(*latency);
    report.cameras.push_back(std::move(*latency));
  }
  return report;
}

}  // namespace

Result<> calibrate_latency(const std::optional<path>& configuration_file, const path& output) {
  const path file = configuration_file.value_or(kConfigurationFile);
  const auto configuration = load_configuration(file);
  if (!configuration) return tl::unexpected(configuration.error());
  if (configuration->cameras.empty()) {
    return fail(ErrorCode::kNotFound, "no camera is configured: add a [[camera]] table", file.string());
  }
  const auto report = measure(*configuration, {});
  if (!report) return tl::unexpected(report.error());
  const path kept = output.empty() ? latency_file(*configuration, file) : output;
  if (auto written = write_file_atomically(kept, write_latency(*report)); !written) return written;
  std::cout << "kept in " << kept.string() << "\n";
  for (const std::string& warning : latency_warnings(*configuration, *report, report->projector))
    std::cout << warning << "\n";
  return {};
}

}  // namespace slsd
