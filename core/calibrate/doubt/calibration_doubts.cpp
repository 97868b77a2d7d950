// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/doubt/calibration_doubts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "core/geometry/robust.hpp"
#include "core/image_size.hpp"

namespace slsd {
namespace {

constexpr double kAlike = 1.6;  // odds within a factor of five

double log_likelihood(const CameraRig& rig, const DepthRange& range) {
  return look_at_rig(rig, range).log_likelihood() + camera_likelihood(rig.camera.lens).sum() +
         projector_likelihood(rig.projector).sum();
}

/// A misreading, and the natural logarithm of its odds against the calibration as given.
struct Ranked {
  const Misreading* misreading;
  double log_odds;
};

/// The advice of the likeliest misreading, and of the next if it is nearly as likely.
std::string advice_of(std::vector<Ranked> ranked) {
  std::ranges::sort(ranked, std::greater(), &Ranked::log_odds);
  std::string advice = ranked.front().misreading->advice;
  if (ranked.size() > 1 && ranked[1].log_odds > ranked[0].log_odds - kAlike) {
    advice += "; or " + ranked[1].misreading->advice;
  }
  return advice;
}

std::string in_two_digits(double value) {
  return value < 10 ? fmt::format("{:.2g}", value) : fmt::format("{:.0f}", value);
}

std::string length_text(double mm) {
  return in_two_digits(mm) + " mm";
}

std::string lens_facts(const char* key, const Lens& lens, const LensLikelihood& likelihood) {
  constexpr double kUnlikely = -5;
  std::string facts;
  if (likelihood.principal_point < kUnlikely) {
    facts += fmt::format("{} has its principal point at ({:.0f}, {:.0f}) of {} px; ", key, lens.cx, lens.cy,
                         size_text(lens.width_px, lens.height_px));
  }
  if (likelihood.focal_length < kUnlikely) {
    const double degrees = 2 * std::atan(0.5 * lens.width_px / lens.fx) * 180 / std::numbers::pi;
    facts += fmt::format(
        "{} has a focal length of {:.4g} px for {} px, a view of {:.3g} degrees (focal lengths are in "
        "pixels); ",
        key, lens.fx, lens.width_px, degrees);
  }
  return facts;
}

std::string facts_of(const CameraRig& rig, const DepthRange& range) {
  constexpr double kHardlyLit = 0.05;
  const RigOutlook outlook = look_at_rig(rig, range);
  std::string facts = lens_facts("camera_matrix", rig.camera.lens, camera_likelihood(rig.camera.lens)) +
                      lens_facts("projector_matrix", rig.projector, projector_likelihood(rig.projector));
  facts += fmt::format(
      "camera and projector are {} apart; from {:.0f} to {:.0f} mm the light moves by {} px, and at {:.0f} mm depth is "
      "exact to {}",
      length_text(outlook.baseline_mm), range.min_mm, range.max_mm, in_two_digits(outlook.parallax_px),
      range.middle_mm(), length_text(outlook.sigma_mm));
  if (outlook.lit_share < kHardlyLit) {
    facts += fmt::format("; the projector lights {:.0f} % of what the camera sees there", 100 * outlook.lit_share);
  }
  return facts;
}

std::string rig_doubt(const CameraRig& rig, const DepthRange& range) {
  constexpr double kImpossible = -12;
  const double given = log_likelihood(rig, range);
  const std::vector<Misreading> misreadings = misreadings_of(rig);
  std::vector<Ranked> better;
  for (const Misreading& each : misreadings) {
    const double log_odds = log_likelihood(each.rig, range) + each.log_prior - given;
    if (log_odds > 0) better.push_back({&each, log_odds});
  }
  if (!better.empty()) {
    return "lengths are in millimetres, and R and T are projector_from_camera; " + advice_of(std::move(better)) +
           ". As it is: " + facts_of(rig, range);
  }
  if (given > kImpossible) return {};
  return "such a rig cannot measure: " + facts_of(rig, range) +
         ". Check the calibration, depth_min_mm and depth_max_mm, or calibrate again with slsd --calibrate";
}

/// Difference between two motions.
struct Disagreement {
  double degrees, mm;

  [[nodiscard]] bool is_large(double length_mm) const {
    constexpr double kDegrees = 2, kShare = 0.1;
    return degrees > kDegrees || mm > kShare * length_mm;
  }
};

Disagreement compare(const RigidTransform& a, const RigidTransform& b) {
  const double turn = Eigen::AngleAxisd(a.rotation.transpose() * b.rotation).angle();
  return {turn * 180 / std::numbers::pi, (a.translation - b.translation).norm()};
}

/// Doubt about a further camera. R and T lead directly to the projector, while rig_from_camera leads there by way of
/// the first camera.
std::string detour_doubt(const CalibratedCamera& first, const CalibratedCamera& camera) {
  const RigidTransform &straight = camera.projector_from_camera, &given = camera.rig_from_camera;
  const double length_mm = std::max(first.projector_from_camera.translation.norm(), straight.translation.norm());
  const auto off = [&](const RigidTransform& rig_from_camera) {
    return compare(straight, first.projector_from_camera.after(rig_from_camera));
  };
  const Disagreement now = off(given);
  if (!now.is_large(length_mm)) return {};
  std::string advice = "one of the two belongs to another rig: calibrate again";
  for (const auto& [meant, text] :
       {std::pair{given, ""}, std::pair{given.inverse(), "looks inverted (camera_from_rig): invert it"}}) {
    for (const auto& [mm, unit] : {std::pair{1.0, ""}, std::pair{1000.0, "metres"}, std::pair{10.0, "centimetres"}}) {
      RigidTransform tried = meant;
      tried.translation *= mm;
      if (off(tried).is_large(length_mm)) continue;
      advice = mm == 1 ? "" : fmt::format("rig_from_camera_T looks like {}: multiply it by {:g}", unit, mm);
      if (*text != '\0') advice += (advice.empty() ? "rig_from_camera " : ", and ") + std::string(text);
    }
  }
  return fmt::format("rig_from_camera disagrees with R and T by {:.0f} mm and {:.1f} degrees; {}", now.mm, now.degrees,
                     advice);
}

// No projector and camera measure so near.
std::string range_doubt(const DepthRange& range) {
  constexpr double kNearestMm = 20;
  if (range.max_mm > kNearestMm) return {};
  return fmt::format(
      "the working range is implausible: depth_min_mm ({:g}) and depth_max_mm ({:g}) are millimetres, and look like "
      "metres: multiply them by 1000",
      range.min_mm, range.max_mm);
}

std::string about(const CalibratedCamera& camera, const std::string& doubt) {
  return "the calibration of camera \"" + camera.name + "\" is implausible: " + doubt;
}

// ---- by symbols ----

/// Results of a calibration for a set of symbols.
struct Explained {
  double on_line_share = 0, points_share = 0;
  std::vector<double> residuals_px{};
  std::vector<double> depths_mm{};  ///< depths of the symbols on their lines, sorted
};

Explained explain(std::span<const Match> matches, const CameraRig& rig, const DepthRange& range, double gate_px) {
  Explained explained;
  std::size_t points = 0;
  for (const Match& match : matches) {
    explained.residuals_px.push_back(epipolar_residual_px(match, rig.camera, rig.projector));
    if (!(explained.residuals_px.back() <= gate_px)) continue;
    const double depth_mm = triangulate(match, rig.camera, rig.projector, 1).point_in_camera.z();
    explained.depths_mm.push_back(std::isfinite(depth_mm) ? depth_mm : 0);
    points += range.holds(depth_mm) ? 1 : 0;
  }
  std::ranges::sort(explained.depths_mm);
  explained.on_line_share = static_cast<double>(explained.depths_mm.size()) / static_cast<double>(matches.size());
  explained.points_share = static_cast<double>(points) / static_cast<double>(matches.size());
  return explained;
}

std::string depths_text(const std::vector<double>& sorted_mm) {
  const auto at = [&](double share) {
    return sorted_mm[static_cast<std::size_t>(share * static_cast<double>(sorted_mm.size() - 1))];
  };
  if (at(0.5) <= 0) return "puts most of them behind the camera";
  return fmt::format("puts most of them from {} to {} away", length_text(std::max(at(0.1), 0.0)), length_text(at(0.9)));
}

/// The misreadings under which most symbols are points.
std::vector<Ranked> explaining(const std::vector<Misreading>& misreadings, std::span<const Match> matches,
                               const DepthRange& range, double gate_px, double enough) {
  std::vector<Ranked> found;
  for (const Misreading& each : misreadings) {
    if (explain(matches, each.rig, range, gate_px).points_share < enough) continue;
    found.push_back({&each, each.log_prior + log_likelihood(each.rig, range)});
  }
  return found;
}

}  // namespace

std::vector<std::string> calibration_doubts(const Calibration& calibration, const DepthRange& range) {
  if (std::string doubt = range_doubt(range); !doubt.empty()) return {std::move(doubt)};
  std::vector<std::string> doubts;
  for (const CalibratedCamera& camera : calibration.cameras) {
    std::string doubt = rig_doubt({camera, calibration.projector}, range);
    if (doubt.empty()) doubt = detour_doubt(calibration.cameras.front(), camera);
    if (!doubt.empty()) doubts.push_back(about(camera, doubt));
  }
  return doubts;
}

std::vector<std::string> calibration_error_warnings(const Calibration& calibration) {
  constexpr double kLargePx = 0.3;
  const CalibrationReport& report = calibration.report;
  std::vector<std::string> warnings;
  const auto look = [&](const std::optional<double>& error_px, const char* what) {
    if (!error_px || !(*error_px > kLargePx)) return;
    warnings.push_back(
        fmt::format("the calibration's {} is {:.2f} px, too much for dense clouds: all their points are off together; "
                    "calibrate again",
                    what, *error_px));
  };
  look(report.reprojection_error_camera_px, "reprojection error in the camera");
  look(report.reprojection_error_projector_px, "reprojection error in the projector");
  look(report.epipolar_error_px, "error across the epipolar lines");
  return warnings;
}

std::string symbol_doubt(std::span<const Match> matches, const CameraRig& rig, const DepthRange& range,
                         double gate_px) {
  constexpr double kMost = 0.5;
  const Explained given = explain(matches, rig, range, gate_px);
  if (matches.size() < kSymbolsForDoubt || given.points_share >= kMost) return {};
  const std::vector<Misreading> misreadings = misreadings_of(rig);
  const std::vector<Ranked> meant = explaining(misreadings, matches, range, gate_px, kMost);
  const std::string read = fmt::format("camera \"{}\": {} symbols of the pattern were read, but the calibration ",
                                       rig.camera.name, matches.size());
  const std::string advice = meant.empty() ? "" : "; " + advice_of(meant);
  if (given.on_line_share >= kMost) {
    const std::string set = fmt::format(
        ", outside the working range: set depth_min_mm ({:g}) and depth_max_mm ({:g}) if they really are there",
        range.min_mm, range.max_mm);
    return read + depths_text(given.depths_mm) + (given.depths_mm[given.depths_mm.size() / 2] > 0 ? set : "") + advice;
  }
  return read + fmt::format("puts them {:.0f} px off their epipolar lines", median_of(given.residuals_px)) +
         (meant.empty() ? ": it belongs to another rig, or the projector or a camera moved: calibrate again" : advice);
}

}  // namespace slsd
