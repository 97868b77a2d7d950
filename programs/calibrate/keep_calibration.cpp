// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/keep_calibration.hpp"
#include "core/calibration_file/calibration_file.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/calibrate/judge/rig_comparison.hpp"
#include "core/geometry/triangulate.hpp"
#include "daemon/scan/rig/hardware.hpp"
#include "drivers/files/file.hpp"

namespace slsd {
namespace {

using std::filesystem::path;

constexpr std::size_t kMaxFileBytes = 1 << 20;
/// More than a rig's drift, and less than the error of a printer that fits to the page.
constexpr double kScalePercent = 0.5, kScaleSigmas = 5;

/// Describes how far the points of the calibrated poses move between the calibrations, root mean square.
std::string difference(const CalibrationOutcome& outcome, const Calibration& before) {
  if (before.projector.width_px != outcome.calibration.projector.width_px ||
      before.projector.height_px != outcome.calibration.projector.height_px) {
    return "it is for a projector of another size";
  }
  double sum = 0;
  std::size_t count = 0;
  for (const PoseObservation& pose : outcome.observations.poses) {
    for (const PoseView& view : pose.views) {
      const CalibratedCamera& camera = outcome.calibration.cameras[view.camera];
      const CalibratedCamera* const other = before.camera(camera.name);
      if (other == nullptr || other->lens.width_px != camera.lens.width_px) return "it is for another camera";
      for (const ProjectedPoint& symbol : view.symbols) {
        const Match match{symbol.camera_px, symbol.projector_px};
        const auto now = triangulate(match, camera, outcome.calibration.projector, 1);
        const auto then = triangulate(match, *other, before.projector, 1);
        const double moved = (now.point_in_camera - then.point_in_camera).squaredNorm();
        if (!symbol.outlying && std::isfinite(moved)) sum += moved, ++count;
      }
    }
  }
  return fmt::format("points on the board differ from it by {:.2f} mm (RMS)",
                     count == 0 ? 0 : std::sqrt(sum / static_cast<double>(count)));
}

bool are_other(const std::string& one, const std::string& other) {
  return !one.empty() && !other.empty() && one != other;
}

bool same_size(const Lens& one, const Lens& other) {
  return one.width_px == other.width_px && one.height_px == other.height_px;
}

/// Tells whether both calibrations belong to the same devices, according to sizes, names and serials.
bool of_the_same_devices(const Calibration& one, const Calibration& other) {
  if (!same_size(one.projector, other.projector) || one.cameras.size() != other.cameras.size()) return false;
  if (are_other(one.report.projector_serial.value_or(""), other.report.projector_serial.value_or(""))) return false;
  for (const CalibratedCamera& camera : one.cameras) {
    const CalibratedCamera* const counterpart = other.camera(camera.name);
    if (counterpart == nullptr || !same_size(camera.lens, counterpart->lens)) return false;
    if (are_other(calibrated_hardware(one, camera), calibrated_hardware(other, *counterpart))) return false;
  }
  return true;
}

std::string dated(const Calibration& calibration) {
  return "the calibration in force" + (calibration.report.date ? " of " + *calibration.report.date : "");
}

/// Checks the board's scale: if the rig has not changed, the distances between its devices measure the board.
Result<> check_scale(const RigComparison& comparison, const Board& board, const Calibration& before) {
  const double percent = 100 * (1 / (1 + comparison.longer_percent / 100) - 1);
  if (std::abs(percent) < std::max(kScalePercent, kScaleSigmas * comparison.longer_sigma_percent)) return {};
  return fail(
      ErrorCode::kMismatch,
      fmt::format("{} measures {:.2f} mm for a board spacing of {:.2f} mm, {:.1f} % {}, and the rig has not changed "
                  "otherwise: measure the print's ruler, and pass the result with --ruler. If the new calibration is "
                  "right, replace the one in force with --force, or save it elsewhere with --output",
                  dated(before), board.pitch_mm * (1 + percent / 100), board.pitch_mm, std::abs(percent),
                  percent > 0 ? "more" : "less"));
}

}  // namespace

std::optional<Calibration> calibration_in_force(const Calibration& calibration, const path& file) {
  const auto text = read_file(file, kMaxFileBytes);
  auto before = text ? read_calibration(*text, file.string()) : tl::unexpected(text.error());
  if (!before || !of_the_same_devices(calibration, *before)) return std::nullopt;
  return std::move(*before);
}

Result<std::string> compare_with_force(const CalibrationOutcome& outcome, const Board& board, const Calibration& before,
                                       bool force) {
  const RigComparison comparison = compare_rigs(outcome, before);
  if (!comparison.change.empty()) {
    const bool other_length =
        std::abs(comparison.longer_percent) > std::max(kScalePercent, kScaleSigmas * comparison.longer_sigma_percent);
    return fmt::format("the rig has changed since {}: {}. The old calibration no longer applies{}", dated(before),
                       comparison.change,
                       other_length ? fmt::format(". Projector and camera are {:.1f} % {} each other; if they only "
                                                  "turned, the print's size is wrong: measure its ruler",
                                                  std::abs(comparison.longer_percent),
                                                  comparison.longer_percent > 0 ? "farther from" : "nearer to")
                                    : "");
  }
  if (!force) {
    if (auto same = check_scale(comparison, board, before); !same) return tl::unexpected(same.error());
  }
  const auto grade = before.report.verdict ? parse_grade(*before.report.verdict) : std::nullopt;
  if (grade && *grade < outcome.verdict.grade) {
    return fail(ErrorCode::kImpossible, fmt::format("the calibration is {}, but the one in force is {} and of the same "
                                                    "rig, so it stays in force; take more poses, as advised",
                                                    to_string(outcome.verdict.grade), to_string(*grade)));
  }
  return std::string();
}

Result<std::string> keep_calibration(const CalibrationOutcome& outcome, const path& file) {
  const std::string text = write_calibration(outcome.calibration);
  if (auto readable = read_calibration(text, file.string()); !readable) return tl::unexpected(readable.error());
  std::string said = "kept in " + file.string();
  std::error_code ignored;
  if (std::filesystem::exists(file, ignored)) {
    const auto before = read_file(file, kMaxFileBytes);
    if (!before) return tl::unexpected(before.error());
    path old = file;
    old += ".old";
    if (auto kept = write_file_atomically(old, *before); !kept) return tl::unexpected(kept.error());
    const auto read = read_calibration(*before, file.string());
    said += "; the previous one is kept in " + old.string() +
            (read ? ", and " + difference(outcome, *read) : ", which cannot be read");
  }
  if (auto written = write_file_atomically(file, text); !written) return tl::unexpected(written.error());
  return said;
}

}  // namespace slsd
