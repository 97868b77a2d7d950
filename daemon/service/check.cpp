// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <iostream>

#include "daemon/configuration/configuration.hpp"
#include "daemon/scan/devices.hpp"
#include "daemon/scan/scan_setup.hpp"
#include "daemon/server/listening_socket.hpp"
#include "daemon/service/commands.hpp"

namespace slsd {
namespace {

using std::filesystem::path;

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
  [[nodiscard]] bool scan_possible() const { return scan_possible_; }

 private:
  bool scan_possible_ = true;
};

std::string size_text(int width_px, int height_px) {
  return std::to_string(width_px) + "x" + std::to_string(height_px) + " px";
}

void check_camera(const CameraOptions& options, const std::optional<Calibration>& calibration, Findings& findings) {
  const std::string name = "camera \"" + options.name() + "\"";
  auto camera = make_camera(options);
  if (!camera) return findings.bad(name + ": " + camera.error().message);
  if (!findings.note((*camera)->open(), name + " opens")) return;
  const CameraDescription& seen = (*camera)->description();
  const CalibratedCamera* known = calibration ? calibration->camera(options.name()) : nullptr;
  if (known == nullptr) return;
  if (known->lens.width_px == seen.width_px && known->lens.height_px == seen.height_px) {
    return findings.good(name + " has the size of its calibration, " + size_text(seen.width_px, seen.height_px));
  }
  findings.bad(name + " gives frames of " + size_text(seen.width_px, seen.height_px) + ", its calibration is for " +
               size_text(known->lens.width_px, known->lens.height_px) +
               ": set the camera's size, or calibrate it again");
}

void check_cameras(const Configuration& configuration, const std::optional<Calibration>& calibration,
                   Findings& findings) {
  if (configuration.cameras.empty()) findings.bad("no camera: add a [[camera]] table to the configuration");
  for (const CameraOptions& camera : configuration.cameras) check_camera(camera, calibration, findings);
}

void check_scan(const Configuration& configuration, Findings& findings) {
  findings.note(make_projector(configuration.projector),
                "projector, " + size_text(configuration.projector.width_px, configuration.projector.height_px));
  const auto pattern = configured_pattern(configuration);
  findings.note(pattern, "pattern");
  if (pattern) {
    for (const std::string& warning : symbol_warnings(pattern->options)) findings.warn(warning);
  }
  const auto calibration = configured_calibration(configuration);
  const bool readable = findings.note(calibration, "calibration");
  if (readable && !*calibration) findings.bad("no calibration: name its file as [calibration] file");
  check_cameras(configuration, readable ? *calibration : std::nullopt, findings);
  if (pattern && readable && *calibration) findings.note(ScanSetup::create(configuration), "decoder");
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
  check_socket(configuration->server.socket, findings);
  return findings.scan_possible();
}

}  // namespace slsd
