// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/correct/correct.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include "core/calibrate/solve/point_residuals.hpp"
#include "core/calibrate/solve/start/initial_rig.hpp"
#include "core/geometry/robust.hpp"

namespace slsd {
namespace {

using Kind = DriftParameter::Kind;

constexpr double kSeenShareMin = 0.8;  // share of the board's points
constexpr std::size_t kSymbolsMin = 100;
constexpr double kLitMin = 0.7;                           // share of the board's width, and of its height, with symbols
constexpr double kOutlyingPointSigmas = 5;                // beyond which a point is outlying
constexpr double kOutlyingMax = 0.3;                      // share of them
constexpr double kLeastSigmaPx = 0.005;                   // no estimator is better than this
constexpr double kCornerMaxPx = 0.3, kSymbolMaxPx = 0.6;  // noise beyond which the model does not fit
constexpr double kBentShareOfSide = 0.002;                // of the longer side
constexpr double kBentSquared = 30;                       // the same in deviations, squared, of three terms
constexpr double kClearlyLikelier = 10;                   // logarithm of a ratio of probabilities
constexpr double kDoubtful = 3;                           // the same, below which both explanations count
constexpr double kPaper = 0.002;                          // change of a print's size by damp air
constexpr double kOtherPrint = 0.01;   // beyond which another print is likelier than a rig that was knocked
constexpr double kHardlyShare = 2e-4;  // of the depth: points that move by less are not worth a correction
constexpr double kSmallShare = 1e-3;   // of the depth: less is within what --verify accepts
constexpr double kCertainTimes = 4;    // of the corrected deviation, that a correction must repair
constexpr double kDriftMax = 8;        // largest drift, in its plausible deviations

/// Spread of residuals that neighbours share, relative to what independent noise would leave in cells of the picture.
double scatter_of(const std::vector<Eigen::Vector2d>& places_px, const std::vector<Eigen::Vector2d>& residuals,
                  double sigma) {
  constexpr int kCells = 4, kPointsMin = 6;
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& place : places_px) box.extend(place);
  std::array<Eigen::Vector2d, kCells * kCells> sums;
  sums.fill(Eigen::Vector2d::Zero());
  std::array<int, kCells * kCells> counts{};
  for (std::size_t i = 0; i < places_px.size(); ++i) {
    const Eigen::Vector2d at = (places_px[i] - box.min()).cwiseQuotient(box.sizes()) * kCells;
    const auto cell = static_cast<std::size_t>(std::min(kCells - 1, static_cast<int>(at.y())) * kCells +
                                               std::min(kCells - 1, static_cast<int>(at.x())));
    sums[cell] += residuals[i], ++counts[cell];
  }
  double square = 0, components = 0;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    if (counts[i] >= kPointsMin) square += sums[i].squaredNorm() / counts[i], components += 2;
  }
  return components > 0 ? std::max(1.0, std::sqrt(square / components) / sigma) : 1;
}

/// The residuals of all views under a rig. Those of symbols are in their own deviations.
struct AllResiduals {
  std::vector<Eigen::Vector2d> corner_places, corners, symbol_places, symbols;
};

AllResiduals residuals_of_all(const Observations& observations, const RigModel& rig) {
  AllResiduals out;
  for (std::size_t pose = 0; pose < observations.poses.size(); ++pose) {
    for (const PoseView& view : observations.poses[pose].views) {
      const ViewResiduals residuals = residuals_of(view, rig, rig.rig_from_board[pose]);
      for (std::size_t i = 0; i < view.corners.size(); ++i) {
        if (view.corners[i].outlying) continue;
        out.corner_places.push_back(view.corners[i].camera_px), out.corners.push_back(residuals.corners_px[i]);
      }
      for (std::size_t i = 0; i < view.symbols.size(); ++i) {
        if (view.symbols[i].outlying) continue;
        out.symbol_places.push_back(view.symbols[i].camera_px);
        out.symbols.emplace_back(residuals.symbols_px[i] / view.symbols[i].sigma_px);
      }
    }
  }
  return out;
}

double sigma_of(const std::vector<Eigen::Vector2d>& residuals) {
  std::vector<double> components;
  for (const Eigen::Vector2d& residual : residuals)
    components.push_back(residual.x()), components.push_back(residual.y());
  return robust_sigma_px(std::move(components));
}

/// Marks points off a rig. @return their share
double mark_outlying(Observations& observations, const RigModel& rig, const ViewNoise& noise) {
  double outlying = 0, all = 0;
  for (std::size_t pose = 0; pose < observations.poses.size(); ++pose) {
    for (PoseView& view : observations.poses[pose].views) {
      const ViewResiduals residuals = residuals_of(view, rig, rig.rig_from_board[pose]);
      const double limit = kOutlyingPointSigmas * std::sqrt(2.0);
      for (std::size_t i = 0; i < view.corners.size(); ++i)
        view.corners[i].outlying = !(residuals.corners_px[i].norm() < limit * noise.corner_px);
      for (std::size_t i = 0; i < view.symbols.size(); ++i) {
        const double sigma_px = noise.symbol_factor * view.symbols[i].sigma_px;
        view.symbols[i].outlying = !(residuals.symbols_px[i].norm() < limit * sigma_px);
        outlying += view.symbols[i].outlying ? 1 : 0, ++all;
      }
    }
  }
  return outlying / all;
}

Result<> check_view_of(const PoseView& view, const std::string& camera, const Board& board) {
  const auto points = static_cast<std::size_t>(board.point_count());
  if (static_cast<double>(view.corners.size()) < kSeenShareMin * static_cast<double>(points)) {
    return fail(
        ErrorCode::kNotFound,
        fmt::format("only {} of the board's {} points are in view: show the whole board", view.corners.size(), points),
        camera);
  }
  if (view.symbols.size() >= kSymbolsMin) return {};
  return fail(ErrorCode::kNotFound,
              fmt::format("only {} symbols of the pattern are seen on the board, but {} are needed: bring all of the "
                          "board into the projector's light, and in focus",
                          view.symbols.size(), kSymbolsMin),
              camera);
}

Result<> check_views(const Observations& observations, const Board& board) {
  for (const PoseObservation& pose : observations.poses) {
    for (std::size_t camera = 0; camera < observations.cameras.size(); ++camera) {
      const std::string& name = observations.cameras[camera].name;
      const auto view = std::ranges::find(pose.views, camera, &PoseView::camera);
      if (view == pose.views.end()) {
        return fail(ErrorCode::kNotFound, "does not see the board: place it where all cameras and the projector see it",
                    name);
      }
      if (auto seen = check_view_of(*view, name, board); !seen) return seen;
    }
  }
  return {};
}

/// Checks that the projector lights most of the board.
Result<> check_lit(const Observations& observations, const RigModel& rig, const Board& board) {
  const double in[] = {board.width_mm(), board.height_mm()};
  for (std::size_t pose = 0; pose < observations.poses.size(); ++pose) {
    const RigidTransform rig_from_board = to_motion(rig.rig_from_board[pose]);
    for (const PoseView& view : observations.poses[pose].views) {
      Eigen::AlignedBox2d lit;
      for (const ProjectedPoint& symbol : view.symbols) {
        if (symbol.outlying) continue;
        const auto point = rig.meet(rig.cameras[view.camera], rig_from_board, symbol.camera_px, PoseSubject::kBoard);
        if (point) lit.extend((rig_from_board.inverse() * *point).head<2>());
      }
      if (!lit.isEmpty() && lit.sizes().x() > kLitMin * in[0] && lit.sizes().y() > kLitMin * in[1]) continue;
      return fail(ErrorCode::kNotFound, "the projector lights only a part of the board: bring all of it into the light",
                  observations.cameras[view.camera].name);
    }
  }
  return {};
}

/// The view with everything free: its noise, and whether the board is flat.
struct FreeView {
  RigModel rig;  // as calibrated, with the places of the board
  ViewNoise noise;
};

Result<> check_flat(const DriftFit& fit, const Board& board) {
  const Eigen::Vector3d terms(fit.rig.shape.terms_mm[0], fit.rig.shape.terms_mm[1], fit.rig.shape.terms_mm[2]);
  double low = 0, high = 0;
  for (const Eigen::Vector3d& point : board.points()) {
    const double height_mm = fit.rig.shape.height_mm(point.head<2>());
    low = std::min(low, height_mm), high = std::max(high, height_mm);
  }
  const double longer_mm = std::max(board.width_mm(), board.height_mm());
  const double squared = terms.dot(fit.shape_covariance.ldlt().solve(terms));
  if (high - low < kBentShareOfSide * longer_mm || squared < kBentSquared) return {};
  return fail(
      ErrorCode::kImpossible,
      fmt::format("the board is bent by {:.2f} mm over its {:.0f} mm, and a correction needs a flat one (at most "
                  "{:.2f} mm): lay it on something flat, or glue it to glass",
                  high - low, longer_mm, kBentShareOfSide * longer_mm));
}

Result<FreeView> free_view(Observations& observations, const Board& board, const Calibration& calibration) {
  const auto moved = [] {
    return fail(ErrorCode::kImpossible,
                "the board's points contradict each other: hold it still until both pictures are taken, and try again");
  };
  FreeView free{to_rig(calibration), {}};
  const Eigen::AlignedBox2d sheet = board.sheet_mm();
  free.rig.shape.frame = {sheet.center(), 0.5 * std::max(board.width_mm(), board.height_mm())};
  for (const PoseObservation& pose : observations.poses) {
    const auto place = estimate_pose(pose, free.rig);
    if (!place) return moved();
    free.rig.rig_from_board.push_back(*place);
  }
  const Explanation all = everything(calibration.cameras.size());
  for (const Weighing weighing : {Weighing::kRobust, Weighing::kEqual}) {
    const auto fit = fit_drift(observations, free.rig, all, free.noise, weighing);
    if (!fit) return moved();
    const AllResiduals residuals = residuals_of_all(observations, fit->rig);
    free.noise.corner_px = std::max(sigma_of(residuals.corners), kLeastSigmaPx);
    free.noise.symbol_factor = std::max(sigma_of(residuals.symbols), 1e-3);
    if (mark_outlying(observations, fit->rig, free.noise) > kOutlyingMax) return moved();
    free.rig.rig_from_board = fit->rig.rig_from_board;
    if (weighing == Weighing::kRobust) continue;
    free.noise.corner_px *= scatter_of(residuals.corner_places, residuals.corners, free.noise.corner_px);
    free.noise.symbol_factor *= scatter_of(residuals.symbol_places, residuals.symbols, free.noise.symbol_factor);
    const double symbol_px = free.noise.symbol_factor * observations.poses[0].views[0].symbols[0].sigma_px;
    if (free.noise.corner_px > kCornerMaxPx || symbol_px > kSymbolMaxPx) {
      return fail(ErrorCode::kImpossible,
                  fmt::format("a turn, a shift or a change of focus do not explain the view: {:.2f} px of the corners "
                              "and {:.2f} px of the symbols remain. Hold the board still; if it stays, calibrate again",
                              free.noise.corner_px, symbol_px));
    }
    if (auto lit = check_lit(observations, fit->rig, board); !lit) return tl::unexpected(lit.error());
    // Again with the noise that was found: the fit knows how certain the bend is.
    const auto judged = fit_drift(observations, free.rig, all, free.noise, weighing);
    if (!judged) return moved();
    if (auto flat = check_flat(*judged, board); !flat) return tl::unexpected(flat.error());
  }
  return free;
}

double print_of(const DriftFit& fit) {
  return fit.rig.board_scale;
}

Result<> check_print(const DriftFit& print, const DriftFit& rig, const Board& board) {
  if (print.log_evidence < rig.log_evidence - kDoubtful) return {};
  const bool alone = print.explanation.size() == 1;
  if (std::abs(print_of(print)) < (alone ? kPaper : kOtherPrint)) return {};
  return fail(
      ErrorCode::kMismatch,
      fmt::format("the board measures {:.2f} mm where it should have {:.2f} mm, {:.1f} % {}: it is another print "
                  "than the one of the calibration, or projector and camera are {} each other. Measure the "
                  "print's ruler, and give --board and --ruler with the result",
                  board.pitch_mm * (1 + print_of(print)), board.pitch_mm, 100 * std::abs(print_of(print)),
                  print_of(print) > 0 ? "more" : "less", print_of(print) > 0 ? "nearer to" : "farther from"));
}

Result<> check_size_of_drift(const DriftFit& fit, double baseline_mm) {
  for (std::size_t i = 0; i < fit.explanation.size(); ++i) {
    const double sigmas =
        std::abs(fit.by(static_cast<Eigen::Index>(i))) / plausible_drift(fit.explanation[i], baseline_mm);
    if (sigmas > kDriftMax) {
      return fail(
          ErrorCode::kImpossible,
          "the rig changed by more than one view can correct: fasten projector and camera, and calibrate again");
    }
  }
  return {};
}

/// Tells whether points move so little that a correction is not worth it.
bool hardly_moves(const std::vector<DeviationAt>& deviations, const CalibrationReport& report) {
  return std::ranges::all_of(deviations, [&](const DeviationAt& at) {
    return at.before_mm < std::max(kHardlyShare * at.depth_mm, 2 * report.depth_sigma_mm(at.depth_mm).value_or(0));
  });
}

bool is_small(const std::vector<DeviationAt>& deviations) {
  return std::ranges::all_of(deviations,
                             [](const DeviationAt& at) { return at.before_mm < kSmallShare * at.depth_mm; });
}

/// A depth at which the view does not tell how to correct. Empty: it tells at all depths. A large drift may hardly move
/// points at one depth, between two at which it moves them to either side: they only need to be known well there.
const DeviationAt* uncertain_depth(const std::vector<DeviationAt>& deviations) {
  const bool small = is_small(deviations);
  const auto found = std::ranges::find_if(deviations, [&](const DeviationAt& at) {
    return at.before_mm < kCertainTimes * at.sigma_mm && (small || at.sigma_mm > kHardlyShare * at.depth_mm);
  });
  return found == deviations.end() ? nullptr : &*found;
}

Calibration corrected(const Calibration& calibration, const RigModel& rig, const std::vector<NamedCamera>& cameras) {
  Calibration out = rig.calibration(cameras);
  out.report = calibration.report;
  for (std::size_t i = 0; i < out.cameras.size(); ++i) out.cameras[i].name = calibration.cameras[i].name;
  return out;
}

/// @param fits  at least one
const DriftFit* likeliest(std::span<const DriftFit> fits) {
  return &*std::ranges::max_element(fits, {}, &DriftFit::log_evidence);
}

}  // namespace

Result<Correction> correct_calibration(Observations observations, const Board& board, const Calibration& calibration,
                                       const CorrectOptions& options) {
  if (auto seen = check_views(observations, board); !seen) return tl::unexpected(seen.error());
  const auto free = free_view(observations, board, calibration);
  if (!free) return tl::unexpected(free.error());
  std::vector<DriftFit> rigs, prints;
  for (const Explanation& explanation : explanations(calibration.cameras.size())) {
    auto fit = fit_drift(observations, free->rig, explanation, free->noise, Weighing::kEqual);
    if (fit) (has(explanation, Kind::kPrint) ? prints : rigs).push_back(std::move(*fit));
  }
  if (rigs.size() < 2 || prints.empty()) {
    return fail(ErrorCode::kImpossible, "the view does not determine where the board is: tilt it, and try again");
  }
  const DriftFit &none = rigs.front(), &best = *likeliest(rigs), &print = *likeliest(prints);
  const bool none_explains = none.explanation.empty() && none.log_evidence > best.log_evidence - kClearlyLikelier;
  Correction correction{false, calibration, {}, {}};
  const DriftFit& drift = best.explanation.empty() ? *likeliest(std::span(rigs).subspan(1)) : best;
  correction.deviations =
      deviations_at(options.depths_mm, free->rig, rigs, static_cast<std::size_t>(&drift - rigs.data()));
  if (!options.print_measured && print.log_evidence > none.log_evidence + kClearlyLikelier) {
    if (auto same = check_print(print, best, board); !same) return tl::unexpected(same.error());
    if (print.explanation.size() == 1 && print.log_evidence > best.log_evidence - kDoubtful) return correction;
  }
  if (none_explains || hardly_moves(correction.deviations, calibration.report)) return correction;
  const double baseline_mm = calibration.cameras[0].projector_from_camera.translation.norm();
  if (auto small = check_size_of_drift(best, baseline_mm); !small) return tl::unexpected(small.error());
  if (const DeviationAt* const at = uncertain_depth(correction.deviations)) {
    if (is_small(correction.deviations)) return correction;
    return fail(
        ErrorCode::kImpossible,
        fmt::format("this view does not tell what drifted, if anything: at {:.0f} mm, points would be corrected "
                    "by {:.2f} mm, give or take {:.2f} mm. Bring the board nearer, so that it fills the picture, "
                    "and tilt it by 20 to 40 degrees",
                    at->depth_mm, at->before_mm, 2 * at->sigma_mm));
  }
  correction.needed = true;
  correction.calibration = corrected(calibration, best.rig, observations.cameras);
  correction.drift = drift_text(best.explanation, best.by, best.covariance, observations.cameras);
  return correction;
}

}  // namespace slsd
