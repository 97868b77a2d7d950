// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/verify/verify.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include <fmt/format.h>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/QR>

#include "core/calibrate/solve/point_residuals.hpp"
#include "core/geometry/plane_fit.hpp"
#include "core/geometry/robust.hpp"
#include "core/geometry/triangulate.hpp"

namespace slsd {
namespace {

constexpr std::size_t kSymbolsMin = 30;
constexpr double kMisreadSigmas = 6, kMisreadMinPx = 1;  // distance from the other symbols' plane
constexpr double kOnPlaneMin = 0.7;                      // share of the symbols
constexpr double kTurnSigmas = 5;                        // above which chance does not explain a turn
constexpr double kScaleOnly = 0.5;  // share of the long distances' error that may remain beside the common factor

struct MeasuredSymbol {
  Eigen::Vector3d point_mm;
  double sigma_mm;  // along the camera's ray
  double epipolar_px;
  Match match;
};

/// Removes misread symbols, which no calibration has checked yet: they lie far from the others, wherever those lie.
std::vector<MeasuredSymbol> without_misread(std::vector<MeasuredSymbol> symbols) {
  std::vector<double> residuals;
  for (const MeasuredSymbol& symbol : symbols) residuals.push_back(symbol.epipolar_px);
  const double median = median_of(residuals);
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
    out.push_back(
        {point.point_in_camera, point.sigma_mm, signed_epipolar_residual_px(match, camera, projector), match});
  }
  return out.empty() ? out : without_misread(std::move(out));
}

/// Ratio of the symbols' noise in this view to the assumed noise, as on a printed board. It compares the residuals from
/// the plane, without a smooth bend, with the expected ones.
double noise_factor(const std::vector<MeasuredSymbol>& symbols, const PlaneFit& plane) {
  const auto rows = static_cast<Eigen::Index>(plane.on_plane.size());
  const Eigen::Vector3d right = plane.normal.unitOrthogonal(), down = plane.normal.cross(right);
  Eigen::MatrixXd terms(rows, 6);
  Eigen::VectorXd off(rows), expected(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const MeasuredSymbol& symbol = symbols[plane.on_plane[static_cast<std::size_t>(i)]];
    const Eigen::Vector3d from_middle = symbol.point_mm - plane.middle;
    const double x = from_middle.dot(right) / 100, y = from_middle.dot(down) / 100;
    terms.row(i) << 1, x, y, x * x, x * y, y * y;
    off(i) = plane.off_mm(symbol.point_mm);
    expected(i) = symbol.sigma_mm * std::abs(plane.normal.dot(symbol.point_mm.normalized()));
  }
  const Eigen::VectorXd rough = off - terms * terms.colPivHouseholderQr().solve(off);
  return std::max(1.0, std::sqrt(rough.squaredNorm() / std::max(expected.squaredNorm(), 1e-12)));
}

/// Root mean square distance from the plane that the symbols' noise explains.
double expected_rms_mm(const std::vector<MeasuredSymbol>& symbols, const PlaneFit& plane) {
  double sum = 0;
  for (const std::size_t i : plane.on_plane) {
    const double across = symbols[i].sigma_mm * plane.normal.dot(symbols[i].point_mm.normalized());
    sum += across * across / static_cast<double>(plane.on_plane.size());
  }
  return noise_factor(symbols, plane) * std::sqrt(sum);
}

/// Finds the turn of the projector that best explains the symbols' distances from their epipolar lines. A view may not
/// show a turn about some axis, and none shows a turn along the lines; the result names that axis.
void find_turn(const std::vector<MeasuredSymbol>& symbols, const CalibratedCamera& camera, const Lens& projector,
               ViewCheck& check) {
  constexpr double kStep = 1e-5, kDegrees = 180 / std::numbers::pi, kShownDeg = 0.01;
  // If a turn by the limit moves the symbols by less than this, it is known no better than the lenses.
  constexpr double kShownPx = 0.05, kTurnRad = 0.03 / kDegrees;
  const auto rows = static_cast<Eigen::Index>(symbols.size());
  Eigen::MatrixX3d slope(rows, 3);
  Eigen::VectorXd off(rows);
  for (Eigen::Index i = 0; i < rows; ++i) off(i) = symbols[static_cast<std::size_t>(i)].epipolar_px;
  for (int axis = 0; axis < 3; ++axis) {
    CalibratedCamera turned = camera;
    const RigidTransform turn{Eigen::AngleAxisd(kStep, Eigen::Vector3d::Unit(axis)).toRotationMatrix(),
                              Eigen::Vector3d::Zero()};
    turned.projector_from_camera = turn.after(camera.projector_from_camera);
    for (Eigen::Index i = 0; i < rows; ++i) {
      const double then = signed_epipolar_residual_px(symbols[static_cast<std::size_t>(i)].match, turned, projector);
      slope(i, axis) = (then - off(i)) / kStep;
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(Eigen::Matrix3d(slope.transpose() * slope));
  const Eigen::Vector3d towards = axes.eigenvectors().transpose() * (slope.transpose() * off);
  Eigen::VectorXd left = off;
  for (int i = 0; i < 3; ++i) {
    if (axes.eigenvalues()(i) > 0) left -= slope * axes.eigenvectors().col(i) * (towards(i) / axes.eigenvalues()(i));
  }
  const double noise_px = std::sqrt(left.squaredNorm() / static_cast<double>(std::max<Eigen::Index>(rows - 3, 1)));
  double square = 0, variance = 0;
  for (int i = 0; i < 3; ++i) {
    const double sigma_deg = noise_px / std::sqrt(std::max(axes.eigenvalues()(i), 1e-12)) * kDegrees;
    const double shown_px = std::sqrt(std::max(axes.eigenvalues()(i), 0.0) / static_cast<double>(rows)) * kTurnRad;
    if (sigma_deg > kShownDeg || shown_px < kShownPx) {
      check.blind_axis = axes.eigenvectors().col(i);
      continue;
    }
    const double by_deg = towards(i) / axes.eigenvalues()(i) * kDegrees;
    square += by_deg * by_deg, variance += sigma_deg * sigma_deg;
  }
  check.turn_deg = std::sqrt(square), check.turn_sigma_deg = std::sqrt(variance);
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

/// A weighted root mean square.
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
                fmt::format("only {} of {} symbols can be measured, but {} are needed: bring the board or plane into "
                            "the projector's light; if it is there, calibrate again",
                            symbols.size(), view.symbols.size(), kSymbolsMin));
  }
  std::vector<Eigen::Vector3d> points;
  for (const MeasuredSymbol& symbol : symbols) points.push_back(symbol.point_mm);
  const auto plane = fit_plane(points);
  const double share = plane ? static_cast<double>(plane->on_plane.size()) / static_cast<double>(points.size()) : 0;
  if (share < kOnPlaneMin) {
    return fail(
        ErrorCode::kImpossible,
        fmt::format(
            "only {:.0f} % of the symbols lie on one plane: show a board, or a flat surface that fills the picture",
            100 * share));
  }
  ViewCheck check;
  check.symbols = plane->on_plane.size();
  check.left_out = view.symbols.size() - check.symbols;
  check.distance_mm = plane->middle.norm();
  check.epipolar_rms_px = epipolar_rms_px(symbols);
  find_turn(symbols, camera, projector, check);
  check.plane_rms_mm = plane->rms_mm;
  check.plane_sigma_mm = expected_rms_mm(symbols, *plane);
  check.trueness = measure_trueness(view.corners, camera.lens, *plane);
  return check;
}

std::vector<VerifyFault> find_faults(const ViewCheck& check, const VerifyLimits& limits) {
  std::vector<VerifyFault> faults;
  const bool turned = check.turn_deg > std::max(limits.turn_deg, kTurnSigmas * check.turn_sigma_deg);
  if (!(check.epipolar_rms_px <= limits.epipolar_px) || turned) faults.push_back(VerifyFault::kEpipolar);
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
