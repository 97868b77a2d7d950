// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/solve/adjustment.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/calibrate/solve/point_residuals.hpp"
#include "core/calibrate/solve/start/initial_rig.hpp"

namespace slsd {
namespace {

/// Standard deviations above which a point is an outlier.
constexpr double kOutlyingSigmas = 5;
/// Smallest deviation of a point: no estimator is better than this, however little noise a few points show.
constexpr double kSigmaMinPx = 0.005;
/// A print that is certainly longer along one axis than along the other by this share.
constexpr double kStretchMin = 0.001, kStretchSigmas = 5;
/// Two prints whose scales certainly differ by this share. A single view does not show whether the view or the print is
/// wrong.
constexpr double kScaleMin = 0.001, kScaleSigmas = 5;
constexpr std::size_t kViewsForScale = 2;
/// A smaller change of the stretch counts as convergence.
constexpr double kStretchSettled = 1e-5;

template <class Visit>
void visit_views(Observations& observations, Visit visit) {
  for (std::size_t i = 0; i < observations.poses.size(); ++i) {
    for (PoseView& view : observations.poses[i].views) visit(view, i);
  }
}

/// Ratio of a view's noise to the session's. The session counts as additional components, because few points are weak
/// evidence. The ratio is limited: a larger one is not noise.
double noise_over(const std::vector<double>& components, double session) {
  constexpr double kSession = 60, kLeast = 0.5, kMost = 2.5;
  const auto count = static_cast<double>(components.size());
  const double own = robust_sigma_px(components) / session;
  return std::clamp(std::sqrt((count * own * own + kSession) / (count + kSession)), kLeast, kMost);
}

/// Narrows the prior of the highest term if a lens folds back on itself within its image.
bool tighten(const DeviceModel& device, DistortionPrior& prior) {
  constexpr double kLess = 0.2;
  if (device.lens[0] <= 0 || to_lens(device.lens, device.size).invertible()) return false;
  prior[4] *= kLess, prior[1] *= std::sqrt(kLess);
  return true;
}

}  // namespace

double value_of(const SharedParameter& parameter, const RigModel& rig) {
  if (parameter.kind == SharedParameter::Kind::kShape)
    return rig.shape.terms_mm[static_cast<std::size_t>(parameter.index)];
  if (parameter.kind == SharedParameter::Kind::kScale) return rig.board_scale;
  if (parameter.kind == SharedParameter::Kind::kStretch) return rig.board_stretch;
  const DeviceModel& device =
      parameter.device < 0 ? rig.projector : rig.cameras[static_cast<std::size_t>(parameter.device)];
  const auto index = static_cast<std::size_t>(parameter.index);
  return parameter.kind == SharedParameter::Kind::kLens ? device.lens[index] : device.device_from_rig[index];
}

/// Calls with each view, its observations, and the residual components of its corners and symbols; those of symbols are
/// in their own deviations.
template <class Visit>
void Adjustment::visit_components(Observations& observations, Visit visit) const {
  visit_views(observations, [&](PoseView& view, std::size_t pose) {
    const PoseSubject subject = observations.poses[pose].subject;
    const ViewResiduals residuals = residuals_of(view, rig_, rig_.rig_from_board[pose], subject);
    std::vector<double> corners, symbols;
    for (const Eigen::Vector2d& r : residuals.corners_px) corners.push_back(r.x()), corners.push_back(r.y());
    for (std::size_t j = 0; options_.with_symbols && j < view.symbols.size(); ++j) {
      const Eigen::Vector2d r = residuals.symbols_px[j] / view.symbols[j].sigma_px;
      symbols.push_back(r.x()), symbols.push_back(r.y());
    }
    visit(view, subject, corners, symbols);
  });
}

void Adjustment::measure_noise(Observations& observations) {
  std::vector<double> board_corners, plane_corners, symbols;
  visit_components(observations, [&](PoseView&, PoseSubject subject, const auto& of_corners, const auto& of_symbols) {
    auto& corners = subject == PoseSubject::kBoard ? board_corners : plane_corners;
    corners.insert(corners.end(), of_corners.begin(), of_corners.end());
    symbols.insert(symbols.end(), of_symbols.begin(), of_symbols.end());
  });
  options_.corner_sigma_px = std::max(robust_sigma_px(std::move(board_corners)), kSigmaMinPx);
  options_.plane_corner_sigma_px = options_.corner_sigma_px;
  if (!plane_corners.empty())
    options_.plane_corner_sigma_px = std::max(robust_sigma_px(std::move(plane_corners)), kSigmaMinPx);
  if (options_.with_symbols) options_.symbol_sigma_factor = std::max(robust_sigma_px(std::move(symbols)), 1e-3);
  visit_components(observations,
                   [&](PoseView& view, PoseSubject subject, const auto& of_corners, const auto& of_symbols) {
                     view.corner_noise = noise_over(of_corners, options_.corner_sigma_of(subject));
                     view.symbol_noise = noise_over(of_symbols, options_.symbol_sigma_factor);
                   });
}

void Adjustment::mark_outlying(Observations& observations) const {
  visit_views(observations, [&](PoseView& view, std::size_t pose) {
    const PoseSubject subject = observations.poses[pose].subject;
    const ViewResiduals residuals = residuals_of(view, rig_, rig_.rig_from_board[pose], subject);
    const double corner_limit_px =
        kOutlyingSigmas * options_.corner_sigma_of(subject) * view.corner_noise * std::sqrt(2.0);
    for (std::size_t j = 0; j < view.corners.size(); ++j) {
      view.corners[j].outlying = residuals.corners_px[j].norm() > corner_limit_px;
    }
    if (!options_.with_symbols) return;
    for (std::size_t j = 0; j < view.symbols.size(); ++j) {
      const double sigma_px = options_.symbol_sigma_factor * view.symbol_noise * view.symbols[j].sigma_px;
      view.symbols[j].outlying = !(residuals.symbols_px[j].norm() < kOutlyingSigmas * sigma_px * std::sqrt(2.0));
    }
  });
}

std::string Adjustment::unplaced_text(const Observations& observations) const {
  std::string names;
  for (std::size_t i = 0; i < equations_.poses.size(); ++i) {
    if (!is_placed(equations_.poses[i])) names += (names.empty() ? "" : ", ") + observations.poses[i].name;
  }
  return names.empty() ? "" : "; left out, because all their points contradict the others: " + names;
}

Result<> Adjustment::find_influence_of(const Observations& observations) {
  auto equations = linearise(observations, options_, rig_);
  if (!equations) return tl::unexpected(equations.error());
  equations_ = std::move(*equations);
  auto influence = find_influence(equations_);
  if (!influence) return fail(influence.error().code, influence.error().message + unplaced_text(observations));
  influence_ = std::move(*influence);
  return {};
}

Result<Adjustment> Adjustment::begin(Observations& observations, RigModel rig) {
  Adjustment adjustment(std::move(rig));
  BundleOptions& options = adjustment.options_;
  for (const DeviceModel& camera : adjustment.rig_.cameras) {
    options.cameras.push_back(plausible_distortion(camera.size, camera.lens[0]));
  }
  options.with_symbols = false;
  options.shape_sigma_mm = plausible_shape(adjustment.rig_.shape.frame);
  if (auto solved = adjust(observations, options, adjustment.rig_); !solved) return tl::unexpected(solved.error());
  if (auto tilted = check_tilts(adjustment.rig_); !tilted) return tl::unexpected(tilted.error());
  adjustment.measure_noise(observations);
  const auto doubtful = estimate_projector(observations, adjustment.rig_);
  if (!doubtful) return tl::unexpected(doubtful.error());
  options.projector = plausible_distortion(adjustment.rig_.projector.size, adjustment.rig_.projector.lens[0]);
  options.with_symbols = true;
  std::vector<PoseObservation> aside = adjustment.set_aside(*doubtful, observations);
  if (auto solved = adjust(observations, options, adjustment.rig_); !solved) return tl::unexpected(solved.error());
  if (auto solved = adjustment.adjust_again(observations); !solved) return tl::unexpected(solved.error());
  // Before judging poses and terms, which absorb the errors of a stretched board.
  if (auto looked = adjustment.look_for_stretch(observations); !looked) return tl::unexpected(looked.error());
  if (auto back = adjustment.take_back(*doubtful, std::move(aside), observations); !back)
    return tl::unexpected(back.error());
  return adjustment;
}

std::vector<PoseObservation> Adjustment::set_aside(const std::vector<std::size_t>& doubtful,
                                                   Observations& observations) {
  std::vector<PoseObservation> aside;
  for (const std::size_t i : doubtful) aside.push_back(observations.poses[i]);
  for (auto i = doubtful.rbegin(); i != doubtful.rend(); ++i) {
    observations.poses.erase(observations.poses.begin() + static_cast<std::ptrdiff_t>(*i));
    rig_.rig_from_board.erase(rig_.rig_from_board.begin() + static_cast<std::ptrdiff_t>(*i));
  }
  return aside;
}

Result<> Adjustment::take_back(const std::vector<std::size_t>& doubtful, std::vector<PoseObservation> aside,
                               Observations& observations) {
  if (doubtful.empty()) return {};
  for (std::size_t i = 0; i < doubtful.size(); ++i) {
    const auto at = static_cast<std::ptrdiff_t>(doubtful[i]);
    rig_.rig_from_board.insert(rig_.rig_from_board.begin() + at,
                               estimate_pose(aside[i], rig_).value_or(MotionVector{0, 0, 0, 0, 0, 1}));
    observations.poses.insert(observations.poses.begin() + at, std::move(aside[i]));
  }
  mark_outlying(observations);
  return find_influence_of(observations);
}

/// Adjusts everything together, with distortions that are invertible over the whole of each image.
Result<> Adjustment::adjust_to_lenses(const Observations& observations) {
  constexpr int kRounds = 8;
  for (int round = 0; round < kRounds; ++round) {
    const auto adjusted = adjust(observations, options_, rig_);
    if (!adjusted) return tl::unexpected(adjusted.error());
    settled_ = adjusted->settled;
    bool tightened = tighten(rig_.projector, options_.projector);
    for (std::size_t i = 0; i < rig_.cameras.size(); ++i) {
      tightened = tighten(rig_.cameras[i], options_.cameras[i]) || tightened;
    }
    if (!tightened) break;
  }
  return {};
}

Result<> Adjustment::adjust_again(Observations& observations) {
  options_.scale = options_.scale && observations.count(PoseSubject::kPlane) >= kViewsForScale;
  if (!options_.scale) rig_.board_scale = 0;
  measure_noise(observations);
  mark_outlying(observations);
  if (auto adjusted = adjust_to_lenses(observations); !adjusted) return adjusted;
  measure_noise(observations);
  return find_influence_of(observations);
}

Result<> Adjustment::begin_with_planes(Observations& observations) {
  options_.scale = observations.count(PoseSubject::kPlane) >= kViewsForScale;
  if (auto solved = adjust(observations, options_, rig_); !solved) return tl::unexpected(solved.error());
  return adjust_again(observations);
}

Result<> Adjustment::compare_prints(Observations& observations) {
  const auto& shared = equations_.shared;
  const auto at = std::ranges::find(shared, SharedParameter::Kind::kScale, &SharedParameter::kind);
  if (at == shared.end()) return {};
  const double scale = rig_.board_scale, sigma = influence_.sigma(static_cast<std::size_t>(at - shared.begin()));
  if (std::abs(scale) < std::max(kScaleMin, kScaleSigmas * sigma)) {
    options_.scale = false;
    return adjust_again(observations);
  }
  warnings_.push_back(
      fmt::format("the board and the reference plane differ in scale: compared with the plane, the board is {:.2f} +- "
                  "{:.3f} % {} than it should be. slsd used the plane's scale; measure the rulers of both prints, and "
                  "give the results with --ruler and --plane-ruler",
                  100 * std::abs(scale), 100 * sigma, scale > 0 ? "larger" : "smaller"));
  return {};
}

bool Adjustment::is_stretched() const {
  const double sigma = influence_.sigma(equations_.shared.size() - 1);
  return std::abs(rig_.board_stretch) >= std::max(kStretchMin, kStretchSigmas * sigma);
}

Result<> Adjustment::look_for_stretch(Observations& observations) {
  if (!options_.stretch) {
    Adjustment trial = *this;
    trial.options_.stretch = true;
    if (auto solved = adjust(observations, trial.options_, trial.rig_); !solved) return tl::unexpected(solved.error());
    if (auto found = trial.find_influence_of(observations); !found) return {};  // the poses do not determine it
    if (!trial.is_stretched()) return {};
    *this = std::move(trial);
  }
  // Without the stretch, its errors counted as noise; as they fall, the points gain weight.
  constexpr int kRounds = 10;
  for (int round = 0; round < kRounds; ++round) {
    const double before = rig_.board_stretch;
    if (auto solved = adjust_again(observations); !solved) return solved;
    if (std::abs(rig_.board_stretch - before) < kStretchSettled) break;
  }
  if (is_stretched()) return {};
  options_.stretch = false, rig_.board_stretch = 0;
  return adjust_again(observations);
}

std::vector<std::string> Adjustment::warnings() const {
  std::vector<std::string> warnings = warnings_;
  if (!settled_) {
    warnings.push_back(
        fmt::format("the adjustment did not converge in {} iterations, so the result is worse than its deviations say; "
                    "take more poses, at more angles and distances",
                    options_.iterations_max));
  }
  if (!options_.stretch) return warnings;
  warnings.push_back(fmt::format(
      "the board's print is stretched: it is {:.2f} +- {:.2f} % {} along its columns than along its rows. slsd "
      "corrected for it, using the rows' scale; measure the print, and print it again without \"fit to page\"",
      100 * std::abs(rig_.board_stretch), 100 * influence_.sigma(equations_.shared.size() - 1),
      rig_.board_stretch > 0 ? "longer" : "shorter"));
  return warnings;
}

}  // namespace slsd
