// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/solve/pose_influence.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace slsd {
namespace {

/// Smallest accepted ratio of the smallest to the largest eigenvalue of the correlations.
constexpr double kInvertTolerance = 1e-13;
/// Share of all poses' information on a parameter below which a pose contributes nothing.
constexpr double kShareMin = 1e-4;
/// Number of points below which a fitting pose contributes nothing.
constexpr Eigen::Index kPointsOfPose = 4;
/// Smallest accepted ratio of the smallest to the largest eigenvalue of the correlations between a pose's own six
/// parameters.
constexpr double kPlacedTolerance = 1e-12;

/// The equations of one pose with its own parameters eliminated (Schur's complement).
struct Reduced {
  Eigen::MatrixXd normal;    // shared x shared
  Eigen::VectorXd gradient;  // shared
};

/// Normal equations of the pose's own parameters.
Eigen::LLT<Eigen::MatrixXd> pose_normal(const PoseEquations& pose) {
  Eigen::MatrixXd normal = pose.by_pose.transpose() * pose.by_pose;
  normal.diagonal() += pose.pose_weight;
  return normal.llt();
}

Reduced reduce(const PoseEquations& pose, Eigen::Index shared) {
  if (!is_placed(pose)) return {Eigen::MatrixXd::Zero(shared, shared), Eigen::VectorXd::Zero(shared)};
  const Eigen::MatrixXd cross = pose.by_shared.transpose() * pose.by_pose;
  const auto own = pose_normal(pose);
  return {pose.by_shared.transpose() * pose.by_shared - cross * own.solve(cross.transpose()),
          pose.by_shared.transpose() * pose.residuals -
              cross * own.solve(Eigen::VectorXd(pose.by_pose.transpose() * pose.residuals))};
}

/// Root mean square distance of the points, from their components in px.
double rms(const Eigen::Ref<const Eigen::VectorXd>& components) {
  return components.size() == 0 ? 0 : std::sqrt(2 * components.squaredNorm() / static_cast<double>(components.size()));
}

/// The residuals of a pose under changed shared parameters, with its own parameters fitted to them.
HeldOut hold_out(const PoseEquations& pose, const Eigen::VectorXd& change) {
  const Eigen::VectorXd moved = pose.residuals + pose.by_shared * change;
  const Eigen::VectorXd own = -pose_normal(pose).solve(Eigen::VectorXd(pose.by_pose.transpose() * moved));
  const Eigen::VectorXd left_px = (moved + pose.by_pose * own).cwiseProduct(pose.sigmas_px);
  return {rms(left_px.head(pose.corner_residuals)), rms(left_px.tail(left_px.size() - pose.corner_residuals))};
}

/// Compares the change that a pose asks for with the freedom that the others leave. In coordinates in which the normal
/// matrix of all poses is the identity, this pose's is diag(share). The difference of its own solution to that of the
/// others is gradient / (share (1 - share)); its variance is 1 / share + 1 / (1 - share).
void compare(const Reduced& pose, const Eigen::MatrixXd& normal, HeldOut& held_out) {
  const Eigen::VectorXd scale = normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(
      scale.asDiagonal() * pose.normal * scale.asDiagonal(), scale.asDiagonal() * normal * scale.asDiagonal());
  if (solver.info() != Eigen::Success) return;
  const Eigen::VectorXd gradient = solver.eigenvectors().transpose() * (scale.asDiagonal() * pose.gradient);
  double sum = 0, count = 0;
  for (Eigen::Index i = 0; i < gradient.size(); ++i) {
    const double share = solver.eigenvalues()(i);
    if (share < kShareMin || share > 1 - kShareMin) continue;
    sum += gradient(i) * gradient(i) / (share * (1 - share)), count += 1;
  }
  held_out.directions = count;
  held_out.disagreement = count > 0 ? std::sqrt(sum / count) : 0;
}

/// Inverts a normal matrix after scaling its diagonal to one.
Result<Eigen::MatrixXd> invert(const Eigen::MatrixXd& normal, const std::vector<SharedParameter>& names) {
  const Eigen::VectorXd scale = normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scale.asDiagonal() * normal * scale.asDiagonal());
  const Eigen::VectorXd& values = solver.eigenvalues();
  if (!(values(0) > kInvertTolerance * values(values.size() - 1))) {
    Eigen::Index worst = 0;
    solver.eigenvectors().col(0).cwiseAbs().maxCoeff(&worst);
    return fail(ErrorCode::kImpossible, "the poses leave " + name_of(names[static_cast<std::size_t>(worst)]) +
                                            " undetermined; show the board at more angles, distances and places");
  }
  const Eigen::MatrixXd inverse =
      solver.eigenvectors() * values.cwiseInverse().asDiagonal() * solver.eigenvectors().transpose();
  return Eigen::MatrixXd(scale.asDiagonal() * inverse * scale.asDiagonal());
}

struct ParameterNames {
  std::string brief, full;
};

ParameterNames names_of(const SharedParameter& parameter) {
  static const ParameterNames kMotion[] = {{"turn_x", "turn about x"},   {"turn_y", "turn about y"},
                                           {"turn_z", "turn about z"},   {"place_x", "place along x"},
                                           {"place_y", "place along y"}, {"place_z", "place along z"}};
  switch (parameter.kind) {
    case SharedParameter::Kind::kShape:
      return {fmt::format("board_bend_{}", parameter.index + 1), fmt::format("bend ({})", parameter.index + 1)};
    case SharedParameter::Kind::kScale:
      return {"board_scale", "scale"};
    case SharedParameter::Kind::kStretch:
      return {"board_stretch", "stretch"};
    case SharedParameter::Kind::kMotion:
    case SharedParameter::Kind::kMovedTo:
      return kMotion[parameter.index];
    case SharedParameter::Kind::kLens:
      break;
  }
  const std::string lens(kLensParameterNames[parameter.index]);
  return {lens, lens};
}

}  // namespace

std::string short_name_of(const SharedParameter& parameter) {
  return names_of(parameter).brief;
}

std::string name_of(const SharedParameter& parameter) {
  using Kind = SharedParameter::Kind;
  const std::string device =
      parameter.kind == Kind::kScale || parameter.kind == Kind::kStretch || parameter.kind == Kind::kShape
          ? "the board's "
      : parameter.device < 0 ? "the projector's "
                             : "camera " + std::to_string(parameter.device) + "'s ";
  return device + names_of(parameter).full;
}

double PoseInfluence::sigma(std::size_t parameter) const {
  const auto i = static_cast<Eigen::Index>(parameter);
  return std::sqrt(std::max(covariance(i, i), 0.0));
}

bool is_placed(const PoseEquations& pose) {
  if (pose.residuals.size() < 2 * kPointsOfPose) return false;
  using PlaceNormal = Eigen::Matrix<double, 6, 6>;
  const PlaceNormal normal = pose.by_pose.leftCols<6>().transpose() * pose.by_pose.leftCols<6>();
  const Eigen::Matrix<double, 6, 1> scale = normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<PlaceNormal> solver(scale.asDiagonal() * normal * scale.asDiagonal());
  return solver.eigenvalues()(0) > kPlacedTolerance * solver.eigenvalues()(5);
}

Result<PoseInfluence> find_influence(const BundleEquations& equations) {
  const auto size = static_cast<Eigen::Index>(equations.shared.size());
  std::vector<Reduced> reduced;
  Eigen::MatrixXd said = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd gradient = equations.prior_pull;
  for (const PoseEquations& pose : equations.poses) {
    reduced.push_back(reduce(pose, size));
    said += reduced.back().normal, gradient += reduced.back().gradient;
  }
  Eigen::MatrixXd normal = said;
  normal.diagonal() += equations.prior_weight;
  PoseInfluence influence;
  double squares = 0, directions = 0;
  for (std::size_t i = 0; i < reduced.size(); ++i) {
    if (!is_placed(equations.poses[i])) {
      influence.held_out.push_back({.placed = false});
      continue;
    }
    const auto without = invert(normal - reduced[i].normal, equations.shared);
    if (!without) return tl::unexpected(without.error());
    HeldOut& held_out = influence.held_out.emplace_back(
        hold_out(equations.poses[i], Eigen::VectorXd(-*without * (gradient - reduced[i].gradient))));
    compare(reduced[i], normal, held_out);
    squares += held_out.directions * held_out.disagreement * held_out.disagreement;
    directions += held_out.directions;
  }
  // Over all poses and directions at once: a dozen poses are weak evidence on a single parameter.
  influence.scatter = directions > 0 ? std::max(1.0, std::sqrt(squares / directions)) : 1;
  Eigen::MatrixXd scattered = said / (influence.scatter * influence.scatter);
  scattered.diagonal() += equations.prior_weight;
  auto covariance = invert(scattered, equations.shared);
  if (!covariance) return tl::unexpected(covariance.error());
  influence.covariance = std::move(*covariance);
  return influence;
}

}  // namespace slsd
