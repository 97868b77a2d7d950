// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <iostream>

#include "core/image_size.hpp"
#include "daemon/commands/commands.hpp"
#include "daemon/commands/device_list.hpp"
#include "daemon/configuration/configuration.hpp"
#include "daemon/configuration/exposure_warnings.hpp"
#include "daemon/latency/latency_file.hpp"
#include "daemon/scan/devices.hpp"
#include "daemon/scan/hardware.hpp"
#include "daemon/scan/scan_setup.hpp"
#include "daemon/server/listening_socket.hpp"
#include "drivers/files/file.hpp"
#include "drivers/projector/x11/choose_output.hpp"
#include "drivers/projector/x11/monitor_report.hpp"

namespace slsd {
namespace {

using std::filesystem::path;

constexpr std::size_t kMaxLatencyBytes = 1 << 20;

/// Prints findings, and keeps whether one of them forbids a scan.
class Findings {
 public:
  void good(const std::string& what) { std::cout << "ok       " << what << "\n"; }
  void warn(const std::string& what) { std::cout << "warning  " << what << "\n"; }
  void bad(const std::string& what) {
    std::cout << "error    " << what << "\n";
    scan_possible_ = false;
  }
  template <class T>
  bool note(const Result<T>& result, const std::string& what) {
    result ? good(what) : bad(what + ": " + to_string(result.error()));
    return result.has_value();
  }
  void other_hardware(const Result<>& same, OtherHardware severity) {
    if (same) return;
    severity == OtherHardware::kError ? bad(to_string(same.error())) : warn(to_string(same.error()));
  }
  [[nodiscard]] bool scan_possible() const { return scan_possible_; }

 private:
  bool scan_possible_ = true;
};

std::string advice_for(const Error& error, const CameraOptions& absent, const Configuration& configuration) {
  if (error.code != ErrorCode::kNotFound || absent.replays()) return {};
  return "; " + CameraList::look(configuration).similar_to(absent);
}

void check_camera(const CameraOptions& options, const Configuration& configuration,
                  const std::optional<Calibration>& calibration, Findings& findings) {
  const std::string name = "camera \"" + options.name() + "\"";
  auto camera = make_camera(options);
  if (!camera) return findings.bad(name + ": " + camera.error().message);
  if (const auto opened = (*camera)->open(); !opened)
    return findings.bad(name + " does not open: " + to_string(opened.error()) +
                        advice_for(opened.error(), options, configuration));
  findings.good(name + " opens");
  const CameraDescription& seen = (*camera)->description();
  const CalibratedCamera* known = calibration ? calibration->camera(options.name()) : nullptr;
  if (known == nullptr) return;
  findings.other_hardware(check_hardware(name, calibrated_hardware(*calibration, *known), seen.hardware),
                          configuration.other_hardware);
  if (known->lens.width_px == seen.width_px && known->lens.height_px == seen.height_px) {
    return findings.good(name + " has the size of its calibration, " + size_text(seen.width_px, seen.height_px) +
                         " px");
  }
  findings.bad(name + " gives frames of " + size_text(seen.width_px, seen.height_px) + " px, its calibration is for " +
               size_text(known->lens.width_px, known->lens.height_px) +
               " px: set the camera's size, or calibrate it again");
}

void check_cameras(const Configuration& configuration, const std::optional<Calibration>& calibration,
                   Findings& findings) {
  if (configuration.cameras.empty()) findings.bad("no camera: add a [[camera]] table to the configuration");
  for (const CameraOptions& camera : configuration.cameras) check_camera(camera, configuration, calibration, findings);
}

// Only looks: the service that runs may be showing its pattern there.
void check_monitor(const Configuration& configuration, const std::optional<Calibration>& calibration,
                   Findings& findings) {
  const ProjectorOptions& options = configuration.projector;
  const auto report = report_monitor(options.monitor, options.width_px, options.height_px);
  if (!report) return findings.bad(to_string(report.error()));
  findings.good("projector: monitor " + describe_output(report->output));
  for (const std::string& warning : report->warnings) {
    findings.warn("projector: monitor " + report->output.name + ": " + warning);
  }
  if (!calibration) return;
  const std::string calibrated = calibration->report.projector_serial.value_or("");
  findings.other_hardware(
      check_hardware("projector", calibrated, projector_hardware(report->output.model, report->output.serial)),
      configuration.other_hardware);
}

void check_projector(const Configuration& configuration, const std::optional<Calibration>& calibration,
                     Findings& findings) {
  const ProjectorOptions& options = configuration.projector;
  if (options.driver == ProjectorDriver::kGlfw) return check_monitor(configuration, calibration, findings);
  const auto projector = make_projector(options);
  findings.note((*projector)->open(), "projector headless, " + size_text(options.width_px, options.height_px) + " px");
}

void check_scan(const Configuration& configuration, Findings& findings) {
  const auto calibration = configured_calibration(configuration);
  check_projector(configuration, calibration ? *calibration : std::nullopt, findings);
  const auto pattern = configured_pattern(configuration);
  findings.note(pattern, "pattern");
  if (pattern) {
    for (const std::string& warning : symbol_warnings(pattern->options)) findings.warn(warning);
  }
  const bool readable = findings.note(calibration, "calibration");
  if (readable && !*calibration) findings.bad("no calibration: name its file as [calibration] file");
  check_cameras(configuration, readable ? *calibration : std::nullopt, findings);
  for (const std::string& warning : exposure_warnings(configuration)) findings.warn(warning);
  if (pattern && readable && *calibration) findings.note(ScanSetup::create(configuration, 1), "decoder");
}

/// As the latency's report names it; empty where that cannot be told.
std::string projector_in_use(const ProjectorOptions& options) {
  const auto projector = make_projector(options);
  if (!projector) return {};
  const ProjectorDescription& description = (*projector)->description();
  if (options.driver == ProjectorDriver::kHeadless) return projector_name(description.driver, description.monitor);
  const auto report = report_monitor(options.monitor, options.width_px, options.height_px);
  return report ? projector_name(description.driver, report->output.name) : "";
}

// A projector in memory has no light to wait for.
void check_latency(const Configuration& configuration, const path& configuration_file, Findings& findings) {
  const path file = latency_file(configuration, configuration_file);
  const auto text = read_file(file, kMaxLatencyBytes);
  if (!text && text.error().code == ErrorCode::kNotFound) {
    if (configuration.projector.driver == ProjectorDriver::kHeadless) return;
    return findings.warn("the latency of projector and cameras was not measured: slsd --calibrate --latency");
  }
  const auto report = text ? read_latency(*text, file) : tl::unexpected(text.error());
  if (!findings.note(report, "latency " + file.string())) return;
  const std::string projector = projector_in_use(configuration.projector);
  for (const std::string& warning : latency_warnings(configuration, *report, projector)) findings.warn(warning);
}

// A daemon that answers there is most likely the one that is being looked at.
void check_socket(const path& socket, Findings& findings) {
  const auto usable = check_socket_path(socket);
  if (!usable && usable.error().code == ErrorCode::kBusy) return findings.good("socket: a daemon answers there");
  findings.note(usable, "socket " + socket.string());
}

}  // namespace

bool check_everything(const std::optional<path>& configuration_file) {
  Findings findings;
  const path file = configuration_file.value_or(kConfigurationFile);
  const auto configuration = load_configuration(file);
  if (!findings.note(configuration, "configuration " + file.string())) return false;
  check_scan(*configuration, findings);
  check_latency(*configuration, file, findings);
  check_socket(configuration->server.socket, findings);
  return findings.scan_possible();
}

}  // namespace slsd
