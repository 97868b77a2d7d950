// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/calibrate.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "core/calibrate/judge/pose_list.hpp"
#include "core/calibrate/judge/verdict.hpp"
#include "core/calibrate/solve/adjustment.hpp"
#include "core/calibrate/solve/point_residuals.hpp"
#include "core/calibrate/solve/start/initial_rig.hpp"
#include "core/geometry/triangulate.hpp"

namespace slsd {
namespace {

constexpr std::size_t kPosesMin = 3;

Result<> check_count(const Observations& observations, const PoseList& poses) {
  if (observations.poses.size() >= kPosesMin) return {};
  const std::string faults = poses.faults();
  return fail(ErrorCode::kImpossible, std::to_string(observations.poses.size()) +
                                          " of the poses can be used, but at least " + std::to_string(kPosesMin) +
                                          " are needed; 10 to 15 make a good calibration" +
                                          (faults.empty() ? "" : ". Left out: " + faults));
}

Result<> check_one_rig(const Adjustment& adjustment, const Observations& observations) {
  const auto change = adjustment.find_change(observations);
  if (!change) return {};
  const auto& poses = observations.poses;
  const std::size_t before = change->first_pose, after = poses.size() - before;
  std::string parts;
  const auto add = [&](std::size_t count, std::size_t first, std::string_view when) {
    if (count < kPosesMin) return;
    parts += fmt::format("{} --use {}:{} has the rig as it {}", parts.empty() ? "" : ",", poses[first].name,
                         poses[first + count - 1].name, when);
  };
  add(after, before, "is now");
  add(before, 0, "was before");
  const std::string now =
      after < kPosesMin ? fmt::format("; only {} poses show the rig as it is now, but {} are needed", after, kPosesMin)
                        : std::string();
  return fail(ErrorCode::kImpossible,
              fmt::format("the rig moved during the session: {}. Fasten the devices and take the poses again{}{}",
                          change->text, parts.empty() ? "" : ", or calibrate with one part of them:" + parts, now));
}

/// Removes poses and points that contradict the rest, one after the other.
Result<> settle(Adjustment& adjustment, Observations& observations, PoseList& poses) {
  do {
    while (const auto contradiction = find_contradiction(observations, adjustment.rig(), adjustment.influence())) {
      poses.leave_out(*contradiction, observations, &adjustment.rig());
      if (auto enough = check_count(observations, poses); !enough) return enough;
      if (auto again = adjustment.adjust_again(observations); !again) return again;
    }
    if (auto adjusted = adjustment.adjust_again(observations); !adjusted) return adjusted;
    if (auto looked = adjustment.look_for_stretch(observations); !looked) return looked;
  } while (find_unplaced(observations, adjustment.rig(), adjustment.influence()));
  return {};
}

Result<Adjustment> solve(Observations& observations, PoseList& poses, const Eigen::AlignedBox2d& sheet_mm) {
  auto initial = estimate_cameras(observations);
  if (!initial) return tl::unexpected(initial.error());
  initial->rig.shape.frame = {sheet_mm.center(), 0.5 * sheet_mm.sizes().maxCoeff()};
  for (auto faulty = initial->faulty.rbegin(); faulty != initial->faulty.rend(); ++faulty) {
    poses.leave_out(*faulty, observations, &initial->rig);
  }
  if (auto enough = check_count(observations, poses); !enough) return tl::unexpected(enough.error());
  auto adjustment = Adjustment::begin(observations, std::move(initial->rig));
  if (!adjustment) return adjustment;
  if (auto one = check_one_rig(*adjustment, observations); !one) return tl::unexpected(one.error());
  const std::size_t count = observations.poses.size();
  if (auto settled = settle(*adjustment, observations, poses); !settled) return tl::unexpected(settled.error());
  if (observations.poses.size() == count) return adjustment;
  // Test again without the poses that contradict the others: a smaller change then shows.
  if (auto one = check_one_rig(*adjustment, observations); !one) return tl::unexpected(one.error());
  return adjustment;
}

/// Moves the views of the reference plane, which come last, out of the observations.
std::vector<PoseObservation> set_planes_aside(Observations& observations) {
  const auto first = std::ranges::find(observations.poses, PoseSubject::kPlane, &PoseObservation::subject);
  std::vector<PoseObservation> planes(std::make_move_iterator(first),
                                      std::make_move_iterator(observations.poses.end()));
  observations.poses.erase(first, observations.poses.end());
  return planes;
}

/// Adds distance errors to the reasons of planes that were left out: a print of another scale also contradicts the
/// poses.
void explain_distances(const std::vector<PlaneCheck>& checks, PoseList& poses) {
  constexpr double kReportedPercentMin = 0.1;
  for (const PlaneCheck& check : checks) {
    if (!check.before || !check.before->trueness) continue;
    const double percent = check.before->trueness->scale_percent;
    if (std::abs(percent) < kReportedPercentMin) continue;
    poses.explain(check.name, fmt::format("; measured with the poses of the board, distances on it are {:.2f} % too {}",
                                          std::abs(percent), percent > 0 ? "long" : "short"));
  }
}

/// @return checks of the planes by the calibration from the poses alone, and by the one from both
Result<std::vector<PlaneCheck>> solve_with_planes(std::vector<PoseObservation> planes, Adjustment& adjustment,
                                                  Observations& observations, PoseList& poses) {
  for (PoseObservation& plane : planes) {
    const auto rig_from_plane = estimate_pose(plane, adjustment.rig());
    adjustment.rig().rig_from_board.push_back(rig_from_plane.value_or(MotionVector{}));
    observations.poses.push_back(std::move(plane));
    if (!rig_from_plane) poses.leave_out(fits_no_plane(observations.poses.size() - 1), observations, &adjustment.rig());
  }
  auto checks = check_planes(observations, adjustment.rig().calibration(observations.cameras));
  if (auto begun = adjustment.begin_with_planes(observations); !begun) return tl::unexpected(begun.error());
  if (auto settled = settle(adjustment, observations, poses); !settled) return tl::unexpected(settled.error());
  if (auto compared = adjustment.compare_prints(observations); !compared) return tl::unexpected(compared.error());
  explain_distances(checks, poses);
  check_again(observations, adjustment.rig().calibration(observations.cameras), checks);
  return checks;
}

void report_points(const Adjustment& adjustment, PoseList& poses, CalibrationOutcome& outcome) {
  std::vector<Eigen::Vector2d> all_corners, all_symbols, all_projected;
  for (std::size_t i = 0; i < outcome.observations.poses.size(); ++i) {
    PoseReport& report = poses.used(i);
    std::vector<Eigen::Vector2d> corners, symbols;
    for (const PoseView& view : outcome.observations.poses[i].views) {
      const ViewResiduals residuals =
          residuals_of(view, adjustment.rig(), adjustment.rig().rig_from_board[i], report.subject);
      for (std::size_t j = 0; j < view.corners.size(); ++j) {
        if (view.corners[j].outlying)
          ++report.outlying_corners;
        else
          corners.push_back(residuals.corners_px[j]);
      }
      for (std::size_t j = 0; j < view.symbols.size(); ++j) {
        if (view.symbols[j].outlying) {
          ++report.outlying_symbols;
          continue;
        }
        symbols.push_back(residuals.symbols_px[j]);
        all_projected.push_back(residuals.symbols_projector_px[j]);
      }
    }
    report.corner_rms_px = rms_px(corners), report.symbol_rms_px = rms_px(symbols);
    report.held_out = adjustment.influence().held_out[i];
    all_corners.insert(all_corners.end(), corners.begin(), corners.end());
    all_symbols.insert(all_symbols.end(), symbols.begin(), symbols.end());
  }
  outcome.camera_rms_px = rms_px(all_corners);
  outcome.symbol_rms_px = rms_px(all_symbols);
  outcome.projector_rms_px = rms_px(all_projected);
}

double epipolar_rms_px(const Observations& observations, const Calibration& calibration) {
  double sum = 0;
  std::size_t count = 0;
  for (const PoseObservation& pose : observations.poses) {
    for (const PoseView& view : pose.views) {
      for (const ProjectedPoint& symbol : view.symbols) {
        if (symbol.outlying) continue;
        const double residual = epipolar_residual_px({symbol.camera_px, symbol.projector_px},
                                                     calibration.cameras[view.camera], calibration.projector);
        sum += residual * residual, ++count;
      }
    }
  }
  return count == 0 ? 0 : std::sqrt(sum / static_cast<double>(count));
}

std::vector<ParameterReport> report_parameters(const Adjustment& adjustment, const Observations& observations) {
  std::vector<ParameterReport> out;
  const auto& shared = adjustment.equations().shared;
  for (std::size_t i = 0; i < shared.size(); ++i) {
    const SharedParameter& parameter = shared[i];
    if (parameter.kind == SharedParameter::Kind::kShape) continue;  // the board's report covers it
    const std::string device =
        parameter.device < 0 ? "projector" : observations.cameras[static_cast<std::size_t>(parameter.device)].name;
    out.push_back(
        {device, short_name_of(parameter), value_of(parameter, adjustment.rig()), adjustment.influence().sigma(i)});
  }
  return out;
}

double root_mean_square(const std::vector<HeldOut>& poses, double HeldOut::*what) {
  double sum = 0;
  for (const HeldOut& pose : poses) sum += pose.*what * pose.*what / static_cast<double>(poses.size());
  return std::sqrt(sum);
}

CalibrationReport file_report(const CalibrationOutcome& outcome, const Adjustment& adjustment) {
  CalibrationReport report;
  report.reprojection_error_camera_px = outcome.camera_rms_px;
  report.reprojection_error_projector_px = outcome.projector_rms_px;
  report.epipolar_error_px = outcome.epipolar_rms_px;
  report.held_out_error_px = outcome.held_out_symbol_px;
  report.verdict = to_string(outcome.verdict.grade);
  if (outcome.depth.size() == 3)
    for (const DepthUncertainty& depth : outcome.depth)
      report.depth_sigma.push_back({depth.depth_mm, depth.calibration_mm});
  report.projector_sigma.assign(9, 0);
  report.camera_sigma.assign(outcome.calibration.cameras.size(), std::vector<double>(9, 0));
  const auto& shared = adjustment.equations().shared;
  for (std::size_t i = 0; i < shared.size(); ++i) {
    if (shared[i].kind != SharedParameter::Kind::kLens) continue;
    auto& sigma =
        shared[i].device < 0 ? report.projector_sigma : report.camera_sigma[static_cast<std::size_t>(shared[i].device)];
    sigma[static_cast<std::size_t>(shared[i].index)] = adjustment.influence().sigma(i);
  }
  return report;
}

CalibrationOutcome report(const Adjustment& adjustment, Observations observations, PoseList& poses,
                          std::vector<PlaneCheck> planes, const Eigen::AlignedBox2d& sheet_mm,
                          const CalibrateOptions& options) {
  CalibrationOutcome outcome;
  outcome.planes = std::move(planes);
  outcome.rig = adjustment.rig();
  outcome.calibration = adjustment.rig().calibration(observations.cameras);
  outcome.observations = std::move(observations);
  report_points(adjustment, poses, outcome);
  outcome.poses = poses.reports();
  outcome.parameters = report_parameters(adjustment, outcome.observations);
  outcome.epipolar_rms_px = epipolar_rms_px(outcome.observations, outcome.calibration);
  outcome.held_out_corner_px = root_mean_square(adjustment.influence().held_out, &HeldOut::corner_rms_px);
  outcome.held_out_symbol_px = root_mean_square(adjustment.influence().held_out, &HeldOut::symbol_rms_px);
  outcome.depth = depth_uncertainty(
      outcome.rig, adjustment.equations().shared, adjustment.influence(), outcome.symbol_rms_px / std::sqrt(2.0),
      {options.depth_min_mm, std::sqrt(options.depth_min_mm * options.depth_max_mm), options.depth_max_mm});
  outcome.board =
      judge_board(outcome.observations, outcome.rig, adjustment.equations().shared, adjustment.influence(), sheet_mm);
  outcome.warnings = adjustment.warnings();
  std::ranges::copy(board_warnings(outcome.board), std::back_inserter(outcome.warnings));
  if (poses.lacks(PoseSubject::kPlane)) {
    outcome.warnings.push_back("no view of the reference plane could be used, so the calibration uses only the poses");
  }
  outcome.verdict = judge(outcome, options.depth_min_mm, options.depth_max_mm);
  outcome.calibration.report = file_report(outcome, adjustment);
  return outcome;
}

}  // namespace

Result<CalibrationOutcome> calibrate(Observations observations, const CalibrateOptions& options) {
  std::ranges::stable_sort(observations.poses, {}, &PoseObservation::subject);
  PoseList poses(observations);
  const std::vector<FaultyPose> unusable = find_unusable(observations);
  for (auto faulty = unusable.rbegin(); faulty != unusable.rend(); ++faulty) {
    poses.leave_out(*faulty, observations, nullptr);
  }
  poses.leave_views_out(observations);
  std::vector<PoseObservation> planes = set_planes_aside(observations);
  if (auto enough = check_count(observations, poses); !enough) return tl::unexpected(enough.error());
  const Eigen::AlignedBox2d sheet_mm = options.sheet_mm.isEmpty() ? seen_of_board(observations) : options.sheet_mm;
  auto adjustment = solve(observations, poses, sheet_mm);
  if (!adjustment) return tl::unexpected(adjustment.error());
  std::vector<PlaneCheck> checks;
  if (!planes.empty()) {
    auto checked = solve_with_planes(std::move(planes), *adjustment, observations, poses);
    if (!checked) return tl::unexpected(checked.error());
    checks = std::move(*checked);
  }
  return report(*adjustment, std::move(observations), poses, std::move(checks), sheet_mm, options);
}

}  // namespace slsd
