// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/solve/bundle.hpp"

#include <array>
#include <cmath>
#include <deque>
#include <memory>

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>

#include "core/calibrate/solve/residuals.hpp"

namespace slsd {
namespace {

constexpr double kHuberSigmas = 3;

/// Shift of all symbols of a view, camera px: a block of the adjustment.
using Shift = std::array<double, 2>;

/// The Ceres problem, and the meaning of its blocks.
class Problem {
 public:
  Problem(const Observations& observations, const BundleOptions& options, RigModel& rig)
      : observations_(observations), options_(options), rig_(rig) {
    for (std::size_t i = 0; i < observations.poses.size(); ++i) add_pose(i);
    for (std::size_t i = 0; i < rig.cameras.size(); ++i) add_prior(rig.cameras[i], options.cameras[i]);
    add_prior(rig.projector, options.projector);
    add_shape_prior();
    hold_constant();
  }

  ceres::Problem& ceres() { return problem_; }
  [[nodiscard]] const std::vector<ceres::ResidualBlockId>& residuals_of(std::size_t pose) const {
    return residuals_[pose];
  }
  [[nodiscard]] std::size_t corners_of(std::size_t pose) const { return corners_[pose]; }
  [[nodiscard]] const std::vector<double>& sigmas_of(std::size_t pose) const { return sigmas_px_[pose]; }
  /// Returns the shifts of the pose's views in which symbols were seen.
  [[nodiscard]] const std::vector<double*>& shifts_of(std::size_t pose) const { return shifts_of_[pose]; }
  double* pose_block(std::size_t pose) { return rig_.rig_from_board[pose].data(); }
  /// Returns the place of the camera with this index, or of the projector: -1.
  double* place_block(int device, std::size_t pose) {
    const bool moved = rig_.moved && pose >= rig_.moved->first_pose && device != 0;
    if (device < 0) return moved ? rig_.moved->projector.data() : rig_.projector.device_from_rig.data();
    const auto camera = static_cast<std::size_t>(device);
    return moved ? rig_.moved->cameras[camera].data() : rig_.cameras[camera].device_from_rig.data();
  }
  double* shape_block(PoseSubject subject) {
    return subject == PoseSubject::kBoard ? rig_.shape.terms_mm.data() : flat_.data();
  }
  double* lit_block(std::size_t pose) {
    const auto own = rig_.rig_from_lit.find(pose);
    return own == rig_.rig_from_lit.end() ? pose_block(pose) : own->second.data();
  }

  /// The poses are eliminated first. Each other block has a group of its own: within a group, Ceres orders blocks by
  /// address, and sums in another order differ in the last digits.
  std::shared_ptr<ceres::ParameterBlockOrdering> ordering() {
    auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    const auto add = [&](double* block, int group) {
      if (problem_.HasParameterBlock(block)) ordering->AddElementToGroup(block, group);
    };
    for (std::size_t i = 0; i < rig_.rig_from_board.size(); ++i) add(pose_block(i), 0);
    for (auto& [pose, lit] : rig_.rig_from_lit) add(lit.data(), 0);
    int group = 0;
    const auto add_device = [&](DeviceModel& device) {
      add(device.lens.data(), ++group), add(device.device_from_rig.data(), ++group);
    };
    for (DeviceModel& camera : rig_.cameras) add_device(camera);
    add_device(rig_.projector);
    if (rig_.moved) {
      for (MotionVector& camera : rig_.moved->cameras) add(camera.data(), ++group);
      add(rig_.moved->projector.data(), ++group);
    }
    for (double* print : {&rig_.board_scale, &rig_.board_stretch, &true_scale_, &true_stretch_,
                          rig_.shape.terms_mm.data(), flat_.data()})
      add(print, ++group);
    for (Shift& shift : shifts_) add(shift.data(), ++group);
    return ordering;
  }

  /// Lists adjusted blocks that all poses share, with their parameters in the order of the columns.
  void list_shared(std::vector<double*>& blocks, std::vector<SharedParameter>& parameters) {
    const auto add_device = [&](DeviceModel& device, int index) {
      if (active(device.lens.data())) {
        blocks.push_back(device.lens.data());
        for (int i = 0; i < 9; ++i) parameters.push_back({SharedParameter::Kind::kLens, index, i});
      }
      if (!active(device.device_from_rig.data())) return;
      blocks.push_back(device.device_from_rig.data());
      for (int i = 0; i < 6; ++i) parameters.push_back({SharedParameter::Kind::kMotion, index, i});
    };
    for (std::size_t i = 0; i < rig_.cameras.size(); ++i) {
      add_device(rig_.cameras[i], static_cast<int>(i));
    }
    add_device(rig_.projector, -1);
    const auto add_moved = [&](MotionVector& place, int index) {
      if (!active(place.data())) return;
      blocks.push_back(place.data());
      for (int i = 0; i < 6; ++i) parameters.push_back({SharedParameter::Kind::kMovedTo, index, i});
    };
    if (rig_.moved) {
      for (std::size_t i = 0; i < rig_.cameras.size(); ++i) add_moved(rig_.moved->cameras[i], static_cast<int>(i));
      add_moved(rig_.moved->projector, -1);
    }
    if (active(rig_.shape.terms_mm.data())) {
      blocks.push_back(rig_.shape.terms_mm.data());
      for (std::size_t i = 0; i < kShapeTerms; ++i)
        parameters.push_back({SharedParameter::Kind::kShape, 0, static_cast<int>(i)});
    }
    const auto add_print = [&](double* block, SharedParameter::Kind kind) {
      if (!active(block)) return;
      blocks.push_back(block);
      parameters.push_back({kind, 0, 0});
    };
    add_print(&rig_.board_scale, SharedParameter::Kind::kScale);
    add_print(&rig_.board_stretch, SharedParameter::Kind::kStretch);
  }

 private:
  [[nodiscard]] bool active(const double* block) const {
    return problem_.HasParameterBlock(block) && !problem_.IsParameterBlockConstant(block);
  }

  void add_pose(std::size_t pose) {
    sigmas_px_.emplace_back(), shifts_of_.emplace_back();
    auto& blocks = residuals_.emplace_back();
    for (const PoseView& view : observations_.poses[pose].views) add_corners(view, pose, blocks);
    corners_.push_back(blocks.size());
    if (!options_.with_symbols) return;
    for (const PoseView& view : observations_.poses[pose].views) add_symbols(view, pose, blocks);
  }

  void add_corners(const PoseView& view, std::size_t pose, std::vector<ceres::ResidualBlockId>& blocks) {
    DeviceModel& camera = rig_.cameras[view.camera];
    const PoseSubject subject = observations_.poses[pose].subject;
    const bool is_board = subject == PoseSubject::kBoard;
    const double sigma_px = options_.corner_sigma_of(subject) * view.corner_noise;
    double* const scale = is_board ? &rig_.board_scale : &true_scale_;
    double* const stretch = is_board ? &rig_.board_stretch : &true_stretch_;
    for (const BoardPoint& point : view.corners) {
      if (point.outlying) continue;
      auto* cost = new CornerResidual(point.camera_px, point.board_mm, sigma_px, rig_.shape.frame);
      blocks.push_back(problem_.AddResidualBlock(cost, &loss_, camera.lens.data(),
                                                 place_block(static_cast<int>(view.camera), pose), pose_block(pose),
                                                 scale, stretch, shape_block(subject)));
      sigmas_px_[pose].push_back(sigma_px);
    }
  }

  void add_symbols(const PoseView& view, std::size_t pose, std::vector<ceres::ResidualBlockId>& blocks) {
    DeviceModel &camera = rig_.cameras[view.camera], &projector = rig_.projector;
    double* shift = nullptr;
    for (const ProjectedPoint& point : view.symbols) {
      if (point.outlying) continue;
      if (shift == nullptr) shift = add_shift(pose);
      const double sigma_px = point.sigma_px * options_.symbol_sigma_factor * view.symbol_noise;
      auto* cost = new SymbolResidual(point.camera_px, point.projector_px, sigma_px, rig_.shape.frame);
      blocks.push_back(problem_.AddResidualBlock(
          cost, &loss_, camera.lens.data(), place_block(static_cast<int>(view.camera), pose), projector.lens.data(),
          place_block(-1, pose), lit_block(pose), shift, shape_block(observations_.poses[pose].subject)));
      sigmas_px_[pose].push_back(sigma_px);
    }
  }

  double* add_shift(std::size_t pose) {
    double* const shift = shifts_.emplace_back().data();
    shifts_of_[pose].push_back(shift);
    const ceres::Matrix in_sigmas = ceres::Matrix::Identity(2, 2) / options_.symbol_shift_px;
    problem_.AddResidualBlock(new ceres::NormalPrior(in_sigmas, ceres::Vector::Zero(2)), nullptr, shift);
    return shift;
  }

  // A lens without observations has no prior: its block is not part of the problem.
  void add_prior(DeviceModel& device, const DistortionPrior& prior) {
    if (!problem_.HasParameterBlock(device.lens.data())) return;
    ceres::Matrix in_sigmas = ceres::Matrix::Zero(static_cast<Eigen::Index>(prior.size()), 9);
    for (std::size_t i = 0; i < prior.size(); ++i)
      in_sigmas(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(kFirstTerm + i)) = 1 / prior[i];
    problem_.AddResidualBlock(new ceres::NormalPrior(in_sigmas, ceres::Vector::Zero(9)), nullptr, device.lens.data());
  }

  void add_shape_prior() {
    double* const terms = rig_.shape.terms_mm.data();
    if (!options_.shape_sigma_mm || !problem_.HasParameterBlock(terms)) return;
    ceres::Matrix in_sigmas = ceres::Matrix::Zero(kShapeTerms, kShapeTerms);
    for (std::size_t i = 0; i < kShapeTerms; ++i) {
      in_sigmas(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(i)) = 1 / (*options_.shape_sigma_mm)[i];
    }
    problem_.AddResidualBlock(new ceres::NormalPrior(in_sigmas, ceres::Vector::Zero(kShapeTerms)), nullptr, terms);
  }

  void hold_constant() {
    keep(rig_.cameras[0].device_from_rig.data());
    // Symbols alone leave the board's place on its plane open.
    for (auto& [pose, lit] : rig_.rig_from_lit) {
      if (problem_.HasParameterBlock(lit.data())) {
        problem_.SetManifold(lit.data(), new ceres::SubsetManifold(6, {2, 3, 4}));
      }
    }
    if (!options_.scale) keep(&rig_.board_scale);
    if (!options_.stretch) keep(&rig_.board_stretch);
    if (!options_.shape_sigma_mm) keep(rig_.shape.terms_mm.data());
    keep(flat_.data());
    keep(&true_scale_);
    keep(&true_stretch_);
  }

  void keep(double* block) {
    if (problem_.HasParameterBlock(block)) problem_.SetParameterBlockConstant(block);
  }

  static ceres::Problem::Options keeps_loss() {
    ceres::Problem::Options options;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }

  const Observations& observations_;
  const BundleOptions& options_;
  RigModel& rig_;
  double true_scale_ = 0, true_stretch_ = 0;  // scale and stretch of the reference plane's print
  ShapeVector flat_{};                        // shape of the reference plane
  ceres::HuberLoss loss_{kHuberSigmas};
  ceres::Problem problem_{keeps_loss()};
  std::vector<std::vector<ceres::ResidualBlockId>> residuals_;
  std::vector<std::vector<double>> sigmas_px_;  // for each residual block
  std::deque<Shift> shifts_;                    // a deque, because its elements never move
  std::vector<std::vector<double*>> shifts_of_;
  std::vector<std::size_t> corners_;
};

Eigen::MatrixXd dense(const ceres::CRSMatrix& sparse) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(sparse.num_rows, sparse.num_cols);
  for (int row = 0; row < sparse.num_rows; ++row) {
    for (int i = sparse.rows[row]; i < sparse.rows[row + 1]; ++i) matrix(row, sparse.cols[i]) = sparse.values[i];
  }
  return matrix;
}

}  // namespace

Result<Adjusted> adjust(const Observations& observations, const BundleOptions& options, RigModel& rig) {
  Problem problem(observations, options, rig);
  ceres::Solver::Options how;
  how.linear_solver_type = ceres::DENSE_SCHUR;
  how.linear_solver_ordering = problem.ordering();
  how.max_num_iterations = options.iterations_max;
  how.function_tolerance = 1e-6;
  how.num_threads = 1;  // with more threads, the order of the sums changes the last digits in every run
  how.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(how, &problem.ceres(), &summary);
  if (!summary.IsSolutionUsable() || !std::isfinite(summary.final_cost)) {
    return fail(ErrorCode::kImpossible,
                "the adjustment does not converge, because the poses do not determine the rig: take more poses, at "
                "more angles and distances");
  }
  return Adjusted{summary.termination_type == ceres::CONVERGENCE, summary.final_cost};
}

Result<BundleEquations> linearise(const Observations& observations, const BundleOptions& options, RigModel rig) {
  Problem problem(observations, options, rig);
  BundleEquations equations;
  std::vector<double*> shared;
  problem.list_shared(shared, equations.shared);
  const auto columns = static_cast<Eigen::Index>(equations.shared.size());
  equations.prior_weight = equations.prior_pull = Eigen::VectorXd::Zero(columns);
  for (Eigen::Index i = 0; i < columns; ++i) {
    const SharedParameter& parameter = equations.shared[static_cast<std::size_t>(i)];
    const auto index = static_cast<std::size_t>(parameter.index);
    if (parameter.kind == SharedParameter::Kind::kShape) {
      equations.prior_weight(i) = std::pow((*options.shape_sigma_mm)[index], -2);
      equations.prior_pull(i) = rig.shape.terms_mm[index] * equations.prior_weight(i);
    }
    if (parameter.kind != SharedParameter::Kind::kLens || index < kFirstTerm) continue;
    const auto device = static_cast<std::size_t>(parameter.device);
    const double sigma = (parameter.device < 0 ? options.projector : options.cameras[device])[index - kFirstTerm];
    equations.prior_weight(i) = 1 / (sigma * sigma);
    equations.prior_pull(i) =
        (parameter.device < 0 ? rig.projector : rig.cameras[device]).lens[index] * equations.prior_weight(i);
  }
  for (std::size_t pose = 0; pose < rig.rig_from_board.size(); ++pose) {
    PoseEquations& out = equations.poses.emplace_back();
    if (problem.residuals_of(pose).empty()) continue;
    ceres::Problem::EvaluateOptions what;
    what.parameter_blocks = shared;
    what.parameter_blocks.push_back(problem.pose_block(pose));
    const std::vector<double*>& shifts = problem.shifts_of(pose);
    what.parameter_blocks.insert(what.parameter_blocks.end(), shifts.begin(), shifts.end());
    what.residual_blocks = problem.residuals_of(pose);
    std::vector<double> residuals;
    ceres::CRSMatrix jacobian;
    if (!problem.ceres().Evaluate(what, nullptr, &residuals, nullptr, &jacobian)) {
      return fail(
          ErrorCode::kImpossible,
          "a symbol of " + observations.poses[pose].name +
              " lies where the projector's light cannot reach the board; take that pose again, or leave it out");
    }
    const Eigen::MatrixXd all = dense(jacobian);
    out.by_shared = all.leftCols(columns);
    out.by_pose = all.rightCols(all.cols() - columns);
    out.pose_weight = Eigen::VectorXd::Constant(out.by_pose.cols(), std::pow(options.symbol_shift_px, -2));
    out.pose_weight.head<6>().setZero();
    out.residuals = Eigen::Map<const Eigen::VectorXd>(residuals.data(), static_cast<Eigen::Index>(residuals.size()));
    what.apply_loss_function = false;
    std::vector<double> plain;
    problem.ceres().Evaluate(what, nullptr, &plain, nullptr, nullptr);
    const std::vector<double>& sigmas = problem.sigmas_of(pose);
    out.sigmas_px.resize(out.residuals.size());
    for (std::size_t i = 0; i < sigmas.size(); ++i) {
      const double lessened = std::hypot(residuals[2 * i], residuals[2 * i + 1]);
      const double loss = lessened > 0 ? std::hypot(plain[2 * i], plain[2 * i + 1]) / lessened : 1;
      out.sigmas_px.segment<2>(static_cast<Eigen::Index>(2 * i)).setConstant(sigmas[i] * loss);
    }
    out.corner_residuals = static_cast<Eigen::Index>(2 * problem.corners_of(pose));
  }
  return equations;
}

}  // namespace slsd
