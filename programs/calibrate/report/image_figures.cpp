// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/report/image_figures.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "core/calibrate/judge/coverage.hpp"
#include "core/calibrate/judge/grade.hpp"
#include "core/calibrate/solve/point_residuals.hpp"
#include "programs/calibrate/report/svg_figure.hpp"

namespace slsd {
namespace {

constexpr double kFigurePx = 460;
constexpr std::size_t kMaxShapes = 2500;
constexpr double kArrowPx = 14;  // length of a residual equal to the RMS
constexpr const char* kOutlying = "#d00";

struct DrawnPoint {
  Eigen::Vector2d pixel;
  Eigen::Vector2d residual_px;  ///< the model's pixel minus the observed one
  std::size_t pose;
  bool outlying;
};

using Points = std::vector<DrawnPoint>;

void add_camera_points(const PoseView& view, const ViewResiduals& residuals, std::size_t pose, Points& points) {
  for (std::size_t i = 0; i < view.corners.size(); ++i) {
    points.push_back({view.corners[i].camera_px, residuals.corners_px[i], pose, view.corners[i].outlying});
  }
}

/// Adds corners and symbols; both count for coverage.
void add_covered_points(const PoseView& view, const ViewResiduals& residuals, std::size_t pose, Points& points) {
  add_camera_points(view, residuals, pose, points);
  for (const ProjectedPoint& symbol : view.symbols) {
    if (!symbol.outlying) points.push_back({symbol.camera_px, Eigen::Vector2d::Zero(), pose, false});
  }
}

void add_projector_points(const PoseView& view, const ViewResiduals& residuals, std::size_t pose, Points& points) {
  for (std::size_t i = 0; i < view.symbols.size(); ++i) {
    points.push_back({view.symbols[i].projector_px, residuals.symbols_projector_px[i], pose, view.symbols[i].outlying});
  }
}

template <class Add>
Points gather(const CalibrationOutcome& outcome, Add&& add) {
  Points points;
  for (std::size_t pose = 0; pose < outcome.observations.poses.size(); ++pose) {
    const PoseObservation& observation = outcome.observations.poses[pose];
    for (const PoseView& view : observation.views) {
      add(view, residuals_of(view, outcome.rig, outcome.rig.rig_from_board[pose], observation.subject), pose, points);
    }
  }
  return points;
}

template <class Add>
Points camera_points(const CalibrationOutcome& outcome, std::size_t camera, Add&& add) {
  return gather(outcome, [&](const PoseView& view, const auto& residuals, std::size_t pose, Points& points) {
    if (view.camera == camera) add(view, residuals, pose, points);
  });
}

Points projector_points(const CalibrationOutcome& outcome) {
  return gather(outcome, add_projector_points);
}

// Few enough for a browser: evenly distributed, every outlier, and at least one in each cell.
Points thinned(const Points& points, const ImageSize& size) {
  const std::size_t step = 1 + points.size() / kMaxShapes;
  Points kept;
  Coverage shown;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double share = shown.share();
    shown.add(points[i].pixel, size);
    if (i % step == 0 || points[i].outlying || shown.share() > share) kept.push_back(points[i]);
  }
  return kept;
}

Eigen::Vector2d size_of(const ImageSize& size) {
  return {static_cast<double>(size.width_px), static_cast<double>(size.height_px)};
}

SvgFigure figure_of(const ImageSize& size) {
  const Eigen::Vector2d half(0.5, 0.5);
  return {-half, size_of(size) - half, kFigurePx};
}

std::string coverage_figure(const ImageSize& size, const Coverage& coverage, const Points& points,
                            const std::string& device) {
  SvgFigure figure = figure_of(size);
  const Eigen::Vector2d cell = size_of(size).cwiseQuotient(Eigen::Vector2d(kCoverageColumns, kCoverageRows));
  for (int i = 0; i < kCoverageColumns * kCoverageRows; ++i) {
    const Eigen::Vector2d first = cell.cwiseProduct(Eigen::Vector2d(i % kCoverageColumns, i / kCoverageColumns));
    if (coverage.counts[i] == 0) figure.rectangle(first, first + cell, "#f9d9d6");
  }
  for (const DrawnPoint& point : thinned(points, size)) figure.dot(point.pixel, 1.3, pose_colour(point.pose));
  figure.frame();
  return figure.str(fmt::format("{}: points in {:.0f} % of the image, {:.0f} % are good; cells without any are red",
                                device, 100 * coverage.share(), 100 * kCoverageGood));
}

double rms_of(const Points& points) {
  std::vector<Eigen::Vector2d> residuals;
  for (const DrawnPoint& point : points) {
    if (!point.outlying) residuals.push_back(point.residual_px);
  }
  return rms_px(residuals);
}

std::string residual_figure(const ImageSize& size, const Points& points, const std::string& device) {
  SvgFigure figure = figure_of(size);
  const double rms = rms_of(points);
  const double magnified = kArrowPx / figure.scale() / std::max(rms, 1e-6);
  // Outliers lie beneath the others and show only a direction: at full length they would hide everything.
  for (const bool outlying : {true, false}) {
    const double longest = (outlying ? 1 : 8) * kArrowPx / figure.scale();
    for (const DrawnPoint& point : thinned(points, size)) {
      if (point.outlying != outlying) continue;
      const std::string colour = outlying ? kOutlying : pose_colour(point.pose);
      Eigen::Vector2d arrow = magnified * point.residual_px;
      if (!arrow.allFinite()) arrow.setZero();  // its rays miss the board
      if (arrow.norm() > longest) arrow *= longest / arrow.norm();
      figure.dot(point.pixel, 1.2, colour);
      figure.line(point.pixel, point.pixel + arrow, colour, 0.7);
    }
  }
  figure.frame();
  const auto outlying = std::ranges::count_if(points, &DrawnPoint::outlying);
  return figure.str(fmt::format(
      "{}: {:.3f} px RMS, arrows enlarged {:.0f} times; {} outliers (red, with shortened arrows) were left out", device,
      rms, magnified, outlying));
}

std::string name_of(const CalibrationOutcome& outcome, std::size_t camera) {
  return camera_text(outcome, outcome.observations.cameras[camera].name);
}

}  // namespace

std::string camera_text(const CalibrationOutcome& outcome, const std::string& name) {
  return outcome.observations.cameras.size() > 1 ? "camera " + name : "camera";
}

std::string camera_coverage_figure(const CalibrationOutcome& outcome, std::size_t camera) {
  return coverage_figure(outcome.observations.cameras[camera].size, camera_coverage(outcome.observations, camera),
                         camera_points(outcome, camera, add_covered_points), name_of(outcome, camera));
}

std::string projector_coverage_figure(const CalibrationOutcome& outcome) {
  return coverage_figure(outcome.observations.projector, projector_coverage(outcome.observations),
                         projector_points(outcome), "projector");
}

std::string camera_residual_figure(const CalibrationOutcome& outcome, std::size_t camera) {
  return residual_figure(outcome.observations.cameras[camera].size, camera_points(outcome, camera, add_camera_points),
                         name_of(outcome, camera) + ", corners");
}

std::string projector_residual_figure(const CalibrationOutcome& outcome) {
  return residual_figure(outcome.observations.projector, projector_points(outcome), "projector, symbols");
}

}  // namespace slsd
