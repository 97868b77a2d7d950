// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/verify.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "core/calibrate/plane_fit.hpp"
#include "core/calibrate/point_residuals.hpp"
#include "core/geometry/triangulate.hpp"

namespace slsd {
namespace {

constexpr std::size_t kSymbolsMin = 30;
constexpr double kMisreadSigmas = 6, kMisreadMinPx = 1;  // off where the other symbols lie
constexpr double kOnPlaneMin = 0.7;                      // of the symbols
constexpr double kScaleOnly = 0.5;  // of the long distances' error, what may be left beside the common factor

struct MeasuredSymbol {
  Eigen::Vector3d point_mm;
  double sigma_mm;  // along the camera's ray
  double epipolar_px;
};

/// Without a calibration to check them by, some symbols are misread: they lie far from the others, wherever those are.
std::vector<MeasuredSymbol> without_misread(std::vector<MeasuredSymbol> symbols) {
  std::vector<double> residuals;
  for (const MeasuredSymbol& symbol : symbols) residuals.push_back(symbol.epipolar_px);
  const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
  std::ranges::nth_element(residuals, middle);
  const double median = *middle;
  for (double& residual : residuals) residual -= median;
  const double gate = std::max(kMisreadMinPx, kMisreadSigmas * robust_sigma_px(residuals));
  std::erase_if(symbols, [&](const MeasuredSymbol& symbol) { return std::abs(symbol.epipolar_px - median) > gate; });
  return symbols;
}

std::vector<MeasuredSymbol> measure(const PoseView& view, const CalibratedCamera& camera, const Lens& projector) {
  std::vector<MeasuredSymbol> out;
  for (const ProjectedPoint& symbol : view.symbols) {
    if (symbol.outlying) continue;
    const Match match{symbol.camera_px, symbol.projector_px};
    const TriangulatedPoint point = triangulate(match, camera, projector, symbol.sigma_px);
    if (!point.point_in_camera.allFinite() || !(point.point_in_camera.z() > 0)) continue;
    out.push_back({point.point_in_camera, point.sigma_mm, signed_epipolar_residual_px(match, camera, projector)});
  }
  return out.empty() ? out : without_misread(std::move(out));
}

/// What the symbols' noise lets expect off the plane.
double expected_rms_mm(const std::vector<MeasuredSymbol>& symbols, const PlaneFit& plane) {
  double sum = 0;
  for (const std::size_t i : plane.on_plane) {
    const double across = symbols[i].sigma_mm * plane.normal.dot(symbols[i].point_mm.normalized());
    sum += across * across / static_cast<double>(plane.on_plane.size());
  }
  return std::sqrt(sum);
}

double epipolar_rms_px(const std::vector<MeasuredSymbol>& symbols) {
  double sum = 0;
  for (const MeasuredSymbol& symbol : symbols) sum += symbol.epipolar_px * symbol.epipolar_px;
  return std::sqrt(sum / static_cast<double>(symbols.size()));
}

bool is_common_factor(const Trueness& trueness) {
  const double square = trueness.long_rms_percent * trueness.long_rms_percent;
  const double left = square - trueness.scale_percent * trueness.scale_percent;
  return left < kScaleOnly * kScaleOnly * square;
}

/// A root mean square over several, each with its weight.
class Pool {
 public:
  void add(double rms, double weight) { sum_ += weight * rms * rms, weight_ += weight; }
  [[nodiscard]] double rms() const { return weight_ > 0 ? std::sqrt(sum_ / weight_) : 0; }

 private:
  double sum_ = 0, weight_ = 0;
};

}  // namespace

double ViewCheck::plane_limit_mm(const VerifyLimits& limits) const {
  return std::min(limits.plane_sigmas * plane_sigma_mm, limits.plane_percent / 100 * distance_mm);
}

Result<ViewCheck> check_view(const PoseView& view, const CalibratedCamera& camera, const Lens& projector) {
  const std::vector<MeasuredSymbol> symbols = measure(view, camera, projector);
  if (symbols.size() < kSymbolsMin) {
    return fail(ErrorCode::kNotFound,
                fmt::format("{} of {} symbols can be measured and {} are needed: bring the board or plane into the "
                            "light of the projector, or, if it is there, calibrate again",
                            symbols.size(), view.symbols.size(), kSymbolsMin));
  }
  std::vector<Eigen::Vector3d> points;
  for (const MeasuredSymbol& symbol : symbols) points.push_back(symbol.point_mm);
  const auto plane = fit_plane(points);
  const double share = plane ? static_cast<double>(plane->on_plane.size()) / static_cast<double>(points.size()) : 0;
  if (share < kOnPlaneMin) {
    return fail(ErrorCode::kImpossible,
                fmt::format("only {:.0f} % of the symbols lie on one plane: show a board, or one flat thing that fills "
                            "the picture",
                            100 * share));
  }
  ViewCheck check;
  check.symbols = plane->on_plane.size();
  check.left_out = view.symbols.size() - check.symbols;
  check.distance_mm = plane->middle.norm();
  check.epipolar_rms_px = epipolar_rms_px(symbols);
  check.plane_rms_mm = plane->rms_mm;
  check.plane_sigma_mm = expected_rms_mm(symbols, *plane);
  check.trueness = measure_trueness(view.corners, camera.lens, *plane);
  return check;
}

std::vector<VerifyFault> find_faults(const ViewCheck& check, const VerifyLimits& limits) {
  std::vector<VerifyFault> faults;
  if (!(check.epipolar_rms_px <= limits.epipolar_px)) faults.push_back(VerifyFault::kEpipolar);
  if (!(check.plane_rms_mm <= check.plane_limit_mm(limits))) faults.push_back(VerifyFault::kPlane);
  if (!check.trueness) return faults;
  const Trueness& trueness = *check.trueness;
  const bool off_scale = !(std::abs(trueness.scale_percent) <= limits.trueness_percent);
  const bool off = !(trueness.long_rms_percent <= limits.trueness_percent);
  if (off_scale || (off && is_common_factor(trueness))) faults.push_back(VerifyFault::kScale);
  if (off && !is_common_factor(trueness)) faults.push_back(VerifyFault::kDistances);
  return faults;
}

VerifySummary summarise(const std::vector<ViewCheck>& checks, const VerifyLimits& limits) {
  VerifySummary summary;
  Pool epipolar, plane, distances;
  std::set<VerifyFault> faults;
  for (const ViewCheck& check : checks) {
    const auto symbols = static_cast<double>(check.symbols);
    epipolar.add(check.epipolar_rms_px, symbols);
    plane.add(100 * check.plane_rms_mm / check.distance_mm, symbols);
    if (check.trueness) {
      distances.add(check.trueness->long_rms_percent, static_cast<double>(check.trueness->corners));
      summary.scale_percent += check.trueness->scale_percent;
      ++summary.views_with_board;
    }
    const std::vector<VerifyFault> found = find_faults(check, limits);
    faults.insert(found.begin(), found.end());
  }
  summary.views = checks.size();
  summary.epipolar_rms_px = epipolar.rms(), summary.plane_percent = plane.rms();
  summary.long_rms_percent = distances.rms();
  if (summary.views_with_board > 0) summary.scale_percent /= static_cast<double>(summary.views_with_board);
  summary.faults.assign(faults.begin(), faults.end());
  return summary;
}

}  // namespace slsd
