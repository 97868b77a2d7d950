// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/correct/fit_drift.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Cholesky>

#include "core/calibrate/solve/bundle.hpp"
#include "core/calibrate/solve/residuals.hpp"
#include "core/geometry/robust.hpp"

namespace slsd {
namespace {

constexpr int kFitRounds = 20;
constexpr double kSettled = 1e-6;    // squared step, in deviations
constexpr double kFarOffSigmas = 4;  // at this distance a point counts a quarter
constexpr Eigen::Index kBend = kSecondOrderTerms, kPlace = 6, kTogether = 2;

template <int kColumns>
using BlockSlopes = Eigen::Matrix<double, 2, kColumns, Eigen::RowMajor>;

/// Derivatives of a device's lens and place with respect to the drift.
struct DeviceSlopes {
  Eigen::Matrix<double, 9, Eigen::Dynamic> lens;
  Eigen::Matrix<double, 6, Eigen::Dynamic> place;
};

/// Everything that is adjusted, and its normal equations. Columns: drift, bend, the board's places, the shifts of all
/// symbols of each view.
class DriftEquations {
 public:
  DriftEquations(const Observations& observations, const RigModel& rig, const Explanation& explanation,
                 const ViewNoise& noise)
      : observations_(observations), calibrated_(rig), explanation_(explanation), noise_(noise), rig_(rig) {
    for (const PoseObservation& pose : observations.poses) views_ += static_cast<Eigen::Index>(pose.views.size());
    const auto poses = static_cast<Eigen::Index>(observations.poses.size());
    count_ = drifts() + kBend + kPlace * poses + kTogether * views_;
    by_ = Eigen::VectorXd::Zero(drifts());
    shifts_.assign(static_cast<std::size_t>(views_), {0, 0});
  }

  /// One step towards the solution. @return its square in deviations; empty: a ray misses the board
  std::optional<double> step(Weighing weighing) {
    if (!build(weighing)) return std::nullopt;
    const Eigen::VectorXd change = -hessian_.ldlt().solve(gradient_);
    if (!change.allFinite()) return std::nullopt;
    apply(change);
    return change.dot(hessian_ * change);
  }

  /// The fit after the last step, which was small.
  [[nodiscard]] std::optional<DriftFit> fit() const {
    const Eigen::LDLT<Eigen::MatrixXd> solver(hessian_);
    if (solver.info() != Eigen::Success || !(solver.vectorD().minCoeff() > 0)) return std::nullopt;
    const Eigen::MatrixXd covariance = solver.solve(Eigen::MatrixXd::Identity(count_, count_));
    DriftFit fit{explanation_, by_, covariance.topLeftCorner(drifts(), drifts()), rig_,
                 covariance.block(drifts(), drifts(), kBend, kBend)};
    fit.log_evidence = -0.5 * (cost_ + solver.vectorD().array().log().sum());
    for (const DriftParameter& parameter : explanation_) fit.log_evidence -= std::log(prior_of(parameter));
    return fit;
  }

 private:
  [[nodiscard]] Eigen::Index drifts() const { return static_cast<Eigen::Index>(explanation_.size()); }
  [[nodiscard]] Eigen::Index own() const { return drifts() + kBend; }
  [[nodiscard]] Eigen::Index place_column(std::size_t pose) const {
    return own() + kPlace * static_cast<Eigen::Index>(pose);
  }
  [[nodiscard]] Eigen::Index shift_column(std::size_t view) const {
    return count_ - kTogether * views_ + kTogether * static_cast<Eigen::Index>(view);
  }
  [[nodiscard]] double prior_of(const DriftParameter& parameter) const {
    return plausible_drift(parameter, to_motion(calibrated_.projector.device_from_rig).translation.norm());
  }

  void apply(const Eigen::VectorXd& change) {
    by_ += change.head(drifts());
    RigModel next = drifted(calibrated_, explanation_, by_);
    next.rig_from_board = rig_.rig_from_board, next.shape = rig_.shape;
    rig_ = std::move(next);
    for (std::size_t i = 0; i < kSecondOrderTerms; ++i) {
      rig_.shape.terms_mm[i] += change(drifts() + static_cast<Eigen::Index>(i));
    }
    for (std::size_t pose = 0; pose < observations_.poses.size(); ++pose) {
      for (std::size_t i = 0; i < 6; ++i) {
        rig_.rig_from_board[pose][i] += change(place_column(pose) + static_cast<Eigen::Index>(i));
      }
    }
    for (std::size_t view = 0; view < shifts_.size(); ++view) {
      shifts_[view][0] += change(shift_column(view)), shifts_[view][1] += change(shift_column(view) + 1);
    }
  }

  /// Finds by differences how the devices follow the drift.
  void find_device_slopes() {
    devices_.assign(rig_.cameras.size() + 1, {});
    for (DeviceSlopes& device : devices_) device.lens.setZero(9, drifts()), device.place.setZero(6, drifts());
    print_slope_ = Eigen::RowVectorXd::Zero(drifts());
    for (Eigen::Index i = 0; i < drifts(); ++i) {
      const double step = 1e-3 * prior_of(explanation_[static_cast<std::size_t>(i)]);
      Eigen::VectorXd more = by_, less = by_;
      more(i) += step, less(i) -= step;
      const RigModel above = drifted(calibrated_, explanation_, more), below = drifted(calibrated_, explanation_, less);
      print_slope_(i) = (above.board_scale - below.board_scale) / (2 * step);
      for (std::size_t device = 0; device < devices_.size(); ++device) {
        const DeviceModel& high = device == 0 ? above.projector : above.cameras[device - 1];
        const DeviceModel& low = device == 0 ? below.projector : below.cameras[device - 1];
        for (std::size_t j = 0; j < 9; ++j)
          devices_[device].lens(static_cast<Eigen::Index>(j), i) = (high.lens[j] - low.lens[j]) / (2 * step);
        for (std::size_t j = 0; j < 6; ++j)
          devices_[device].place(static_cast<Eigen::Index>(j), i) =
              (high.device_from_rig[j] - low.device_from_rig[j]) / (2 * step);
      }
    }
  }

  bool build(Weighing weighing) {
    hessian_ = Eigen::MatrixXd::Zero(count_, count_), gradient_ = Eigen::VectorXd::Zero(count_), cost_ = 0;
    find_device_slopes();
    std::size_t view_index = 0;
    for (std::size_t pose = 0; pose < observations_.poses.size(); ++pose) {
      for (const PoseView& view : observations_.poses[pose].views) {
        if (!add_corners(view, pose, view_index, weighing)) return false;
        if (!add_symbols(view, pose, view_index++, weighing)) return false;
      }
    }
    add_priors();
    return std::isfinite(cost_);
  }

  /// Rows of one view's points, two to a point. Columns: drift, bend, the board's place, the shift of its symbols.
  struct Rows {
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> slopes;
    Eigen::VectorXd residuals;
  };
  [[nodiscard]] Rows rows_for(std::size_t points) const {
    const auto count = 2 * static_cast<Eigen::Index>(points);
    return {Eigen::MatrixXd::Zero(count, own() + kPlace + kTogether), Eigen::VectorXd::Zero(count)};
  }

  bool add_corners(const PoseView& view, std::size_t pose, std::size_t view_index, Weighing weighing) {
    const DeviceModel& camera = rig_.cameras[view.camera];
    const DeviceSlopes& by_drift = devices_[view.camera + 1];
    Rows rows = rows_for(view.corners.size());
    Eigen::Index at = -2;
    for (const BoardPoint& corner : view.corners) {
      at += 2;
      if (corner.outlying) continue;
      const CornerResidual cost(corner.camera_px, corner.board_mm, noise_.corner_px, rig_.shape.frame);
      BlockSlopes<9> lens;
      BlockSlopes<6> seat, place;
      Eigen::Vector2d larger, longer;
      BlockSlopes<static_cast<int>(kShapeTerms)> shape;
      const std::array<const double*, 6> blocks{
          camera.lens.data(), camera.device_from_rig.data(), rig_.rig_from_board[pose].data(),
          &rig_.board_scale,  &rig_.board_stretch,           rig_.shape.terms_mm.data()};
      std::array<double*, 6> slopes{lens.data(), seat.data(), place.data(), larger.data(), longer.data(), shape.data()};
      if (!cost.Evaluate(blocks.data(), rows.residuals.data() + at, slopes.data())) return false;
      auto row = rows.slopes.middleRows<2>(at);
      row.leftCols(drifts()).noalias() = lens.lazyProduct(by_drift.lens) + seat.lazyProduct(by_drift.place);
      row.leftCols(drifts()).noalias() += larger.lazyProduct(print_slope_);
      row.middleCols<kBend>(drifts()) = shape.leftCols<kBend>();
      row.middleCols<kPlace>(own()) = place;
    }
    add(rows, pose, view_index, weighing);
    return true;
  }

  bool add_symbols(const PoseView& view, std::size_t pose, std::size_t view_index, Weighing weighing) {
    const DeviceModel &camera = rig_.cameras[view.camera], &projector = rig_.projector;
    const DeviceSlopes &of_camera = devices_[view.camera + 1], &of_projector = devices_[0];
    Rows rows = rows_for(view.symbols.size());
    Eigen::Index at = -2;
    for (const ProjectedPoint& symbol : view.symbols) {
      at += 2;
      if (symbol.outlying) continue;
      const double sigma_px = symbol.sigma_px * noise_.symbol_factor;
      const SymbolResidual cost(symbol.camera_px, symbol.projector_px, sigma_px, rig_.shape.frame);
      BlockSlopes<9> lens, light;
      BlockSlopes<6> seat, stand, place;
      BlockSlopes<2> together;
      BlockSlopes<static_cast<int>(kShapeTerms)> shape;
      const std::array<const double*, 7> blocks{camera.lens.data(),
                                                camera.device_from_rig.data(),
                                                projector.lens.data(),
                                                projector.device_from_rig.data(),
                                                rig_.rig_from_board[pose].data(),
                                                shifts_[view_index].data(),
                                                rig_.shape.terms_mm.data()};
      std::array<double*, 7> slopes{lens.data(),  seat.data(),     light.data(), stand.data(),
                                    place.data(), together.data(), shape.data()};
      if (!cost.Evaluate(blocks.data(), rows.residuals.data() + at, slopes.data())) return false;
      auto row = rows.slopes.middleRows<2>(at);
      row.leftCols(drifts()).noalias() = lens.lazyProduct(of_camera.lens) + seat.lazyProduct(of_camera.place);
      row.leftCols(drifts()).noalias() += light.lazyProduct(of_projector.lens) + stand.lazyProduct(of_projector.place);
      row.middleCols<kBend>(drifts()) = shape.leftCols<kBend>();
      row.middleCols<kPlace>(own()) = place;
      row.rightCols<kTogether>() = together;
    }
    add(rows, pose, view_index, weighing);
    return true;
  }

  /// Adds rows to the normal equations.
  void add(Rows& rows, std::size_t pose, std::size_t view_index, Weighing weighing) {
    if (weighing == Weighing::kRobust) weigh(rows);
    cost_ += rows.residuals.squaredNorm();
    std::vector<Eigen::Index> columns;
    for (Eigen::Index i = 0; i < own(); ++i) columns.push_back(i);
    for (Eigen::Index i = 0; i < kPlace; ++i) columns.push_back(place_column(pose) + i);
    for (Eigen::Index i = 0; i < kTogether; ++i) columns.push_back(shift_column(view_index) + i);
    const Eigen::MatrixXd product = rows.slopes.transpose() * rows.slopes;
    const Eigen::VectorXd pull = rows.slopes.transpose() * rows.residuals;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      gradient_(columns[i]) += pull(static_cast<Eigen::Index>(i));
      for (std::size_t j = 0; j < columns.size(); ++j)
        hessian_(columns[i], columns[j]) += product(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }

  /// Points far off hardly count, whatever the noise may be.
  static void weigh(Rows& rows) {
    std::vector<double> far;
    for (Eigen::Index i = 0; i < rows.residuals.size(); i += 2) far.push_back(rows.residuals.segment<2>(i).norm());
    const double scale = kFarOffSigmas * std::max(1.0, median_of(far));
    for (std::size_t i = 0; i < far.size(); ++i) {
      const double root = std::sqrt(robust_weight(far[i], scale));
      rows.slopes.middleRows<2>(2 * static_cast<Eigen::Index>(i)) *= root;
      rows.residuals.segment<2>(2 * static_cast<Eigen::Index>(i)) *= root;
    }
  }

  void add_prior(Eigen::Index column, double value, double sigma) {
    hessian_(column, column) += 1 / (sigma * sigma);
    gradient_(column) += value / (sigma * sigma);
    cost_ += value * value / (sigma * sigma);
  }

  void add_priors() {
    for (Eigen::Index i = 0; i < drifts(); ++i)
      add_prior(i, by_(i), prior_of(explanation_[static_cast<std::size_t>(i)]));
    const ShapeVector bend_mm = plausible_shape(rig_.shape.frame);
    for (std::size_t i = 0; i < kSecondOrderTerms; ++i)
      add_prior(drifts() + static_cast<Eigen::Index>(i), rig_.shape.terms_mm[i], bend_mm[i]);
    const double together_px = BundleOptions{}.symbol_shift_px;
    for (std::size_t view = 0; view < shifts_.size(); ++view) {
      add_prior(shift_column(view), shifts_[view][0], together_px);
      add_prior(shift_column(view) + 1, shifts_[view][1], together_px);
    }
  }

  const Observations& observations_;
  const RigModel& calibrated_;
  const Explanation& explanation_;
  const ViewNoise& noise_;
  RigModel rig_;
  Eigen::Index views_ = 0, count_ = 0;
  Eigen::VectorXd by_;
  std::vector<std::array<double, 2>> shifts_;  // px of the camera, one for each view
  std::vector<DeviceSlopes> devices_;          // the projector first
  Eigen::RowVectorXd print_slope_;
  Eigen::MatrixXd hessian_;
  Eigen::VectorXd gradient_;
  double cost_ = 0;
};

}  // namespace

std::optional<DriftFit> fit_drift(const Observations& observations, const RigModel& rig, const Explanation& explanation,
                                  const ViewNoise& noise, Weighing weighing) {
  DriftEquations equations(observations, rig, explanation, noise);
  for (int round = 0; round < kFitRounds; ++round) {
    const auto moved = equations.step(weighing);
    if (!moved) return std::nullopt;
    if (*moved < kSettled) break;
  }
  return equations.fit();
}

}  // namespace slsd
