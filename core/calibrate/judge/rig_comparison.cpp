// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/judge/rig_comparison.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include <fmt/format.h>
#include <Eigen/Geometry>

namespace slsd {
namespace {

constexpr double kDegreesOfRadian = 180 / std::numbers::pi;
constexpr double kSurelySigmas = 5;  // above which chance does not explain a difference
/// Differences that move no measurement by more than a good calibration's own error.
constexpr double kTurnMinDeg = 0.03, kShiftMinShare = 2e-3, kFocalMinShare = 2e-3, kPrincipalMinPx = 3;
constexpr double kUpsideDownDeg = 150, kAboutAxis = 0.9;
constexpr char kProjector[] = "projector";

using Sigmas = std::vector<double>;  // for fx fy cx cy ...; empty: unknown

double sigma_of(const CalibrationOutcome& outcome, const std::string& device, std::string_view parameter) {
  for (const ParameterReport& one : outcome.parameters) {
    if (one.device == device && one.name == parameter) return one.sigma;
  }
  return 0;
}

/// Root of the sum of squares over three parameters.
double sigma_of_three(const CalibrationOutcome& outcome, const std::string& device, const std::string& kind) {
  double sum = 0;
  for (const char* const axis : {"_x", "_y", "_z"}) sum += std::pow(sigma_of(outcome, device, kind + axis), 2);
  return std::sqrt(sum);
}

/// Describes a lens's change in words; empty without one.
std::string lens_change(const CalibrationOutcome& outcome, const std::string& device, const std::string& text,
                        const Lens& now, const Lens& then, const Sigmas& then_sigmas) {
  const auto differs = [&](std::size_t index, std::string_view name, double is, double was, double least) {
    const double own = sigma_of(outcome, device, name);
    const double other = then_sigmas.size() > index && then_sigmas[index] > 0 ? then_sigmas[index] : own;
    return std::abs(is - was) > std::max(least, kSurelySigmas * std::hypot(own, other));
  };
  const double least = kFocalMinShare * then.fx;
  if (differs(0, "fx", now.fx, then.fx, least) || differs(1, "fy", now.fy, then.fy, least)) {
    return fmt::format("{} has another lens, zoom or focus: its focal length is {:.0f} px, but was {:.0f} px", text,
                       now.fx, then.fx);
  }
  if (differs(2, "cx", now.cx, then.cx, kPrincipalMinPx) || differs(3, "cy", now.cy, then.cy, kPrincipalMinPx)) {
    return fmt::format(
        "the image of {} is cropped or shifted differently: its principal point is at ({:.0f}, {:.0f}) px, but was at "
        "({:.0f}, {:.0f}) px",
        text, now.cx, now.cy, then.cx, then.cy);
  }
  return {};
}

/// Two devices with a common view: the place of one in the frame of the other, then and now.
struct Pair {
  RigidTransform now, then;  // second from first
  double turn_sigma_deg = 0, place_sigma_mm = 0;

  [[nodiscard]] Eigen::AngleAxisd turn() const { return Eigen::AngleAxisd(now.rotation * then.rotation.transpose()); }
  [[nodiscard]] double turn_deg() const { return turn().angle() * kDegreesOfRadian; }
  /// The first device's place in the second's frame, and the second's in the first's.
  [[nodiscard]] double first_moved_mm() const { return (now.translation - then.translation).norm(); }
  [[nodiscard]] double second_moved_mm() const {
    return (now.inverse().translation - then.inverse().translation).norm();
  }
  [[nodiscard]] double longer() const { return now.translation.norm() / then.translation.norm() - 1; }
  [[nodiscard]] double longer_sigma() const { return std::sqrt(2.0) * place_sigma_mm / then.translation.norm(); }
  /// Part of a move that a common factor of all distances does not explain.
  [[nodiscard]] double sideways_mm() const { return (now.translation - (1 + longer()) * then.translation).norm(); }

  [[nodiscard]] bool turned() const { return turn_deg() > std::max(kTurnMinDeg, kSurelySigmas * turn_sigma_deg); }
  [[nodiscard]] bool changed() const {
    // A turn within its deviation moves the place accordingly; this adds to the place's uncertainty.
    const double unsure_mm = std::hypot(place_sigma_mm, turn_sigma_deg / kDegreesOfRadian * now.translation.norm());
    return turned() || sideways_mm() > std::max(kShiftMinShare * then.translation.norm(),
                                                kSurelySigmas * std::sqrt(2.0) * unsure_mm);
  }
};

/// Uncertainty of the principal point, as the turn that would look the same.
double unknown_turn_deg(const Lens& lens, const Sigmas& sigmas) {
  if (sigmas.size() < 4) return 0;
  return std::hypot(sigmas[2] / lens.fx, sigmas[3] / lens.fy) * kDegreesOfRadian;
}

Sigmas camera_sigmas(const Calibration& calibration, const CalibratedCamera& camera) {
  const auto index = static_cast<std::size_t>(&camera - calibration.cameras.data());
  return index < calibration.report.camera_sigma.size() ? calibration.report.camera_sigma[index] : Sigmas{};
}

class Comparison {
 public:
  Comparison(const CalibrationOutcome& outcome, const Calibration& before) : outcome_(outcome), before_(before) {
    for (const CalibratedCamera& camera : outcome.calibration.cameras)
      before_cameras_.push_back(before.camera(camera.name));
  }

  RigComparison compare() const {
    RigComparison comparison;
    const auto add = [&](const std::string& text) {
      if (!text.empty()) comparison.change += (comparison.change.empty() ? "" : "; ") + text;
    };
    const auto& cameras = outcome_.calibration.cameras;
    add(lens_change(outcome_, kProjector, "the projector", outcome_.calibration.projector, before_.projector,
                    before_.report.projector_sigma));
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      add(lens_change(outcome_, cameras[i].name, name_of(i), cameras[i].lens, before_cameras_[i]->lens,
                      camera_sigmas(before_, *before_cameras_[i])));
    }
    add(places());
    const Pair pair = of_projector(0);
    comparison.longer_percent = 100 * pair.longer();
    comparison.longer_sigma_percent = 100 * pair.longer_sigma();
    return comparison;
  }

 private:
  [[nodiscard]] std::string name_of(std::size_t camera) const {
    const auto& cameras = outcome_.calibration.cameras;
    return cameras.size() == 1 ? "the camera" : "camera " + cameras[camera].name;
  }

  /// Projector from camera.
  [[nodiscard]] Pair of_projector(std::size_t camera) const {
    const CalibratedCamera &now = outcome_.calibration.cameras[camera], &then = *before_cameras_[camera];
    Pair pair{now.projector_from_camera, then.projector_from_camera};
    put_sigmas(kProjector, before_.projector, before_.report.projector_sigma, camera, pair);
    return pair;
  }

  /// The first camera from another.
  [[nodiscard]] Pair of_cameras(std::size_t camera) const {
    const auto relative = [&](const CalibratedCamera& first, const CalibratedCamera& other) {
      return first.rig_from_camera.inverse().after(other.rig_from_camera);
    };
    Pair pair{relative(outcome_.calibration.cameras[0], outcome_.calibration.cameras[camera]),
              relative(*before_cameras_[0], *before_cameras_[camera])};
    put_sigmas(outcome_.calibration.cameras[camera].name, before_cameras_[camera]->lens,
               camera_sigmas(before_, *before_cameras_[camera]), camera, pair);
    return pair;
  }

  void put_sigmas(const std::string& device, const Lens& then_lens, const Sigmas& then_sigmas, std::size_t camera,
                  Pair& pair) const {
    const std::string& name = outcome_.calibration.cameras[camera].name;
    const double own_deg = std::hypot(sigma_of_three(outcome_, device, "turn"),
                                      device == name ? 0 : sigma_of_three(outcome_, name, "turn")) *
                           kDegreesOfRadian;
    const double then_deg =
        std::hypot(unknown_turn_deg(then_lens, then_sigmas),
                   unknown_turn_deg(before_cameras_[camera]->lens, camera_sigmas(before_, *before_cameras_[camera])));
    pair.turn_sigma_deg = std::hypot(own_deg, then_deg > 0 ? std::min(then_deg, 4 * own_deg) : own_deg);
    pair.place_sigma_mm = std::hypot(sigma_of_three(outcome_, device, "place"),
                                     device == name ? 0 : sigma_of_three(outcome_, name, "place"));
  }

  /// Names the devices that have moved.
  [[nodiscard]] std::string places() const {
    const Pair projector = of_projector(0);
    std::vector<std::size_t> moved;
    const std::size_t count = outcome_.calibration.cameras.size();
    for (std::size_t i = 1; i < count; ++i) {
      if (of_cameras(i).changed()) moved.push_back(i);
    }
    if (count == 1) return projector.changed() ? text_of(projector, device_of(projector)) : std::string();
    if (projector.changed() && moved.size() == count - 1) return text_of(projector, name_of(0));
    std::string text = projector.changed() ? text_of(projector, "the projector") : std::string();
    for (const std::size_t i : moved) text += (text.empty() ? "" : "; ") + text_of(of_cameras(i), name_of(i));
    return text;
  }

  /// A device that turns about its own centre stays in place for the other one.
  [[nodiscard]] std::string device_of(const Pair& pair) const {
    constexpr double kClearly = 3;
    const double unsure_mm = std::max(kSurelySigmas * pair.place_sigma_mm, 0.5);
    const double camera_mm = pair.first_moved_mm(), projector_mm = pair.second_moved_mm();
    if (camera_mm + unsure_mm < projector_mm && kClearly * camera_mm < projector_mm) return name_of(0);
    if (projector_mm + unsure_mm < camera_mm && kClearly * projector_mm < camera_mm) return "the projector";
    return name_of(0) + " or the projector";
  }

  static std::string text_of(const Pair& pair, const std::string& device) {
    const Eigen::AngleAxisd turn = pair.turn();
    const double moved_mm = std::min(pair.first_moved_mm(), pair.second_moved_mm());
    const std::string moved = moved_mm > std::max(kSurelySigmas * pair.place_sigma_mm, 0.5)
                                  ? fmt::format("moved by {:.1f} mm", moved_mm)
                                  : "";
    if (pair.turn_deg() > kUpsideDownDeg && std::abs(turn.axis().z()) > kAboutAxis) {
      return fmt::format("{} turned by {:.0f} degrees about its axis, upside down{}", device, pair.turn_deg(),
                         moved.empty() ? "" : " and " + moved);
    }
    if (!pair.turned()) return device + " " + (moved.empty() ? "moved sideways" : moved);
    return fmt::format("{} turned by {:.2f} degrees{}", device, pair.turn_deg(), moved.empty() ? "" : " and " + moved);
  }

  const CalibrationOutcome& outcome_;
  const Calibration& before_;
  std::vector<const CalibratedCamera*> before_cameras_;
};

}  // namespace

RigComparison compare_rigs(const CalibrationOutcome& outcome, const Calibration& before) {
  return Comparison(outcome, before).compare();
}

}  // namespace slsd
