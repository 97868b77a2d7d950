// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/outcome_text.hpp"

#include <fmt/format.h>

namespace slsd {
namespace {

void add_poses(const CalibrationOutcome& outcome, std::string& text) {
  text += "pose           corners  px (held out)    symbols  px (held out)\n";
  for (const PoseReport& pose : outcome.poses) {
    if (pose.fault) {
      text += fmt::format("{:<14} left out: {}\n", pose.name, pose.reason);
      continue;
    }
    text += fmt::format("{:<14} {:>7}  {:.3f} ({:.3f})  {:>9}  {:.3f} ({:.3f})", pose.name, pose.corners,
                        pose.corner_rms_px, pose.held_out.corner_rms_px, pose.symbols, pose.symbol_rms_px,
                        pose.held_out.symbol_rms_px);
    if (pose.outlying_corners + pose.outlying_symbols > 0) {
      text +=
          fmt::format("  {} corners and {} symbols left out as outliers", pose.outlying_corners, pose.outlying_symbols);
    }
    text += "\n";
    for (const std::string& remark : pose.remarks) text += "               " + remark + "\n";
    for (const std::string& view : pose.without) text += "               without " + view + "\n";
  }
}

void add_parameters(const CalibrationOutcome& outcome, std::string& text) {
  std::string device;
  for (const ParameterReport& parameter : outcome.parameters) {
    if (parameter.device != device) text += fmt::format("{}:\n", device = parameter.device);
    text += fmt::format("  {:<14} {:>13.5f} +- {:.5f}\n", parameter.name, parameter.value, parameter.sigma);
  }
}

void add_errors(const CalibrationOutcome& outcome, std::string& text) {
  text +=
      fmt::format("reprojection error (RMS): camera {:.3f} px, projector {:.3f} px, symbols in the camera {:.3f} px\n",
                  outcome.camera_rms_px, outcome.projector_rms_px, outcome.symbol_rms_px);
  text += fmt::format("on poses held out: corners {:.3f} px, symbols {:.3f} px; off the epipolar line {:.3f} px\n",
                      outcome.held_out_corner_px, outcome.held_out_symbol_px, outcome.epipolar_rms_px);
  for (const DepthUncertainty& depth : outcome.depth) {
    text += fmt::format(
        "depth at {:.0f} mm: uncertain by {:.2f} mm from the calibration, by {:.2f} mm for a single symbol\n",
        depth.depth_mm, depth.calibration_mm, depth.noise_mm);
  }
}

/// "0.31 mm, +0.012 %"
std::string plane_text(const std::optional<ViewCheck>& check) {
  if (!check) return "not measured";
  const std::string distances =
      check->trueness ? fmt::format(", distances {:+.3f} %", check->trueness->scale_percent) : "";
  return fmt::format("{:.3f} mm off it (noise {:.3f}){}", check->plane_rms_mm, check->plane_sigma_mm, distances);
}

std::string plane_text(std::string_view when, const VerifySummary& summary) {
  return fmt::format("  {}: {:.4f} % of the distance off it; scale {:+.3f} %, long distances {:.3f} %\n", when,
                     summary.plane_percent, summary.scale_percent, summary.long_rms_percent);
}

void add_planes(const CalibrationOutcome& outcome, std::string& text) {
  if (outcome.planes.empty()) return;
  text += "reference plane:\n";
  for (const PlaneCheck& plane : outcome.planes) {
    text += fmt::format("  {:<10} before: {}; after: {}\n",
                        outcome.rig.cameras.size() > 1 ? plane.name + " " + plane.camera : plane.name,
                        plane_text(plane.before), plane_text(plane.after));
  }
  text += plane_text("before the second step", summarise(outcome.planes, &PlaneCheck::before));
  text += plane_text("after it", summarise(outcome.planes, &PlaneCheck::after));
}

}  // namespace

std::string outcome_text(const CalibrationOutcome& outcome) {
  std::string text;
  add_poses(outcome, text);
  add_parameters(outcome, text);
  add_errors(outcome, text);
  add_planes(outcome, text);
  text += "the board: " + board_text(outcome.board) + "\n";
  for (const std::string& warning : outcome.warnings) text += "warning: " + warning + "\n";
  text += fmt::format("verdict: {}\n", to_string(outcome.verdict.grade));
  for (const std::string& reason : outcome.verdict.reasons) text += "  because " + reason + "\n";
  for (const std::string& advice : outcome.verdict.advice) text += "  next: " + advice + "\n";
  return text;
}

}  // namespace slsd
