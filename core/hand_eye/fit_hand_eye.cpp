// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/hand_eye/fit_hand_eye.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "core/hand_eye/first_places.hpp"

namespace slsd {
namespace {

template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;
template <class T>
using Matrix3 = Eigen::Matrix<T, 3, 3>;

constexpr int kRounds = 4;  // of adjusting, and of estimating the noise
constexpr int kNoiseSteps = 40;
constexpr double kSettled = 1e-4;
constexpr double kNoiseStepMax = 2;   // in the logarithm of a variance
constexpr double kNoiseSpread = 2.8;  // one deviation of the logarithm of a variance, before any pose: a factor of 4 in
                                      // the deviation
constexpr double kAnywhereMm = 1e5, kAnywhereRad = 100;  // so that undetermined directions have a variance
constexpr double kLateness = 0.3;
constexpr double kStrayMm = 300, kStrayRad = 0.5;  // how far an unrelated pose is off
constexpr double kStrayShare = 0.01;
constexpr double kHeldMm = 250, kStandingMm = 1500;  // usual distances from the flange, and from the base

double log_normal(double value, double sigma) {
  return -0.5 * (value * value / (sigma * sigma) + std::log(2 * std::numbers::pi * sigma * sigma));
}

template <class T>
struct Motion {
  Matrix3<T> turn;
  Vector3<T> place;
};

template <class T>
Matrix3<T> rotation_of(const Vector3<T>& vector) {
  Matrix3<T> rotation;
  ceres::AngleAxisToRotationMatrix(vector.data(), rotation.data());  // both by columns
  return rotation;
}

template <class T>
Vector3<T> vector_of(const Matrix3<T>& rotation) {
  Vector3<T> vector;
  ceres::RotationMatrixToAngleAxis(rotation.data(), vector.data());
  return vector;
}

template <class T>
Motion<T> cast(const RigidTransform& motion) {
  return {motion.rotation.cast<T>(), motion.translation.cast<T>()};
}

// A motion changed by six numbers: a turn, and a shift, both along the axes of its target.
template <class T>
Motion<T> changed(const RigidTransform& motion, const T* change) {
  const Vector3<T> turn(change[0], change[1], change[2]), shift(change[3], change[4], change[5]);
  return {rotation_of(turn) * motion.rotation.cast<T>(), motion.translation.cast<T>() + shift};
}

RigidTransform changed_by(const RigidTransform& motion, const double* change) {
  const Motion<double> now = changed(motion, change);
  return {now.turn, now.place};
}

/// Index of each in the vector of unknowns. The places of scanner and board come first.
struct Unknowns {
  int scanner_after = -1, board_after = -1, late = -1, shared = 0, count = 12;
};

/// The point about which the unknowns are changes, and the noise.
struct State {
  RigidTransform scanner, board, scanner_after, board_after;
  Eigen::VectorXd late, shared;
  RobotNoise noise;
};

class Adjustment {
 public:
  Adjustment(const HandEyeSession& session, const HandEyeModel& model) : session_(session), model_(model) {
    for (std::size_t i = 0; i < session.views.size(); ++i) {
      if (std::ranges::find(model.left_out, i) == model.left_out.end()) counting_.push_back(i);
    }
    const auto take = [this](Eigen::Index size) {
      return std::exchange(at_.count, at_.count + static_cast<int>(size));
    };
    const auto views = static_cast<Eigen::Index>(session.views.size());
    if (model.scanner_moved) at_.scanner_after = take(6), know_move();
    if (model.board_moved) at_.board_after = take(6), know_move();
    if (model.late)
      at_.late = take(views - 1), known_.insert(known_.end(), static_cast<std::size_t>(views - 1), kLateness);
    for (Eigen::Index i = 0; i < session.shared.sigma.size(); ++i) {
      if (session.shared.sigma[i] > 0) shared_.push_back(i), known_.push_back(session.shared.sigma[i]);
    }
    at_.shared = take(static_cast<Eigen::Index>(shared_.size()));
    state_.late = Eigen::VectorXd::Zero(model.late ? views - 1 : 0);
    state_.shared = Eigen::VectorXd::Zero(session.shared.sigma.size());
    weights_.assign(counting_.size(), Matrix6d::Identity());
    begin();
  }

  HandEyeFit fit() {
    linearise();
    estimate_noise();
    for (int round = 0; round < kRounds; ++round) {
      adjust();
      linearise();
      estimate_noise();
    }
    return result();
  }

  // Residuals of the views that count, then what is known beforehand; raw: in rad, mm and the unknowns' own units.
  template <class T>
  void residuals(const T* change, bool raw, T* out) const {
    const Motion<T> scanner = changed(state_.scanner, change), board = changed(state_.board, change + 6);
    Motion<T> scanner_after = scanner, board_after = board;
    std::size_t known = 0;
    T* const known_out = out + 6 * counting_.size();
    const auto know = [&](const T& value) {
      known_out[known] = raw ? value : value / known_[known];
      ++known;
    };
    const auto know_move_of = [&](const Motion<T>& before, const Motion<T>& after) {
      const Vector3<T> turn = vector_of(Matrix3<T>(after.turn * before.turn.transpose()));
      const Vector3<T> shift = after.place - before.place;
      for (int i = 0; i < 3; ++i) know(turn[i]);
      for (int i = 0; i < 3; ++i) know(shift[i]);
    };
    if (model_.scanner_moved)
      scanner_after = changed(state_.scanner_after, change + at_.scanner_after), know_move_of(scanner, scanner_after);
    if (model_.board_moved)
      board_after = changed(state_.board_after, change + at_.board_after), know_move_of(board, board_after);
    Eigen::Matrix<T, Eigen::Dynamic, 1> late = state_.late.template cast<T>();
    for (Eigen::Index i = 0; i < late.size(); ++i) late[i] += change[at_.late + i], know(late[i]);
    Eigen::Matrix<T, Eigen::Dynamic, 1> shared = state_.shared.template cast<T>();
    for (std::size_t i = 0; i < shared_.size(); ++i) {
      T& each = shared[shared_[i]];
      each += change[at_.shared + static_cast<int>(i)];
      know(each);
    }
    std::size_t row = 0;
    Motion<T> base_from_flange;
    for (std::size_t i = 0; i < session_.views.size(); ++i) {
      const HandEyeView& view = session_.views[i];
      base_from_flange = i > 0 && model_.late
                             ? carried_on(base_from_flange, view, late[static_cast<Eigen::Index>(i) - 1])
                             : cast<T>(view.base_from_flange);
      if (row == counting_.size() || counting_[row] != i) continue;
      const bool scanner_is_after = model_.scanner_moved && i >= *model_.scanner_moved;
      const bool board_is_after = model_.board_moved && i >= *model_.board_moved;
      const Eigen::Matrix<T, 6, 1> residual =
          residual_of(view, base_from_flange, scanner_is_after ? scanner_after : scanner,
                      board_is_after ? board_after : board, shared);
      Eigen::Map<Eigen::Matrix<T, 6, 1>> there(out + 6 * row);
      if (raw) {
        there = residual;
      } else {
        there = weights_[row].template cast<T>() * residual;
      }
      ++row;
    }
  }

  [[nodiscard]] int rows() const { return static_cast<int>(6 * counting_.size() + known_.size()); }
  [[nodiscard]] int unknowns() const { return at_.count; }

 private:
  void know_move() { known_.insert(known_.end(), {kMovedRad, kMovedRad, kMovedRad, kMovedMm, kMovedMm, kMovedMm}); }

  // The robot had a share of the way from the view before still to go when its pose was read.
  template <class T>
  static Motion<T> carried_on(const Motion<T>& before, const HandEyeView& view, const T& late) {
    const Motion<T> read = cast<T>(view.base_from_flange);
    const Vector3<T> way = vector_of(Matrix3<T>(read.turn * before.turn.transpose()));
    return {rotation_of(Vector3<T>(late * way)) * read.turn, read.place + late * (read.place - before.place)};
  }

  template <class T>
  Eigen::Matrix<T, 6, 1> residual_of(const HandEyeView& view, const Motion<T>& base_from_flange,
                                     const Motion<T>& scanner, const Motion<T>& board,
                                     const Eigen::Matrix<T, Eigen::Dynamic, 1>& shared) const {
    const RigidTransform& seen = view.board.rig_from_board;
    const Vector3<T> middle = board.turn * view.board.middle_mm.cast<T>() + board.place;
    Matrix3<T> turn;
    Vector3<T> in_mount;
    if (session_.mounted == Mounted::kArm) {
      turn = base_from_flange.turn.transpose() * board.turn;
      in_mount = base_from_flange.turn.transpose() * (middle - base_from_flange.place);
    } else {
      turn = base_from_flange.turn * board.turn;
      in_mount = base_from_flange.turn * middle + base_from_flange.place;
    }
    Eigen::Matrix<T, 6, 1> residual;
    residual.template head<3>() =
        vector_of(Matrix3<T>(scanner.turn.transpose() * turn * seen.rotation.transpose().cast<T>()));
    residual.template tail<3>() =
        scanner.turn.transpose() * (in_mount - scanner.place) - (seen * view.board.middle_mm).cast<T>();
    return residual - view.board.by_shared.cast<T>() * shared;
  }

  void begin() {
    std::vector<const HandEyeView*> before, after;
    const std::size_t moved = model_.scanner_moved.value_or(model_.board_moved.value_or(session_.views.size()));
    for (const std::size_t i : counting_) (i < moved ? before : after).push_back(&session_.views[i]);
    const bool begin_after = after.size() > before.size();
    const HandEyePlaces places = first_places(session_.mounted, begin_after ? after : before);
    state_.scanner = state_.scanner_after = places.mount_from_rig;
    state_.board = state_.board_after = places.stand_from_board;
    const std::vector<const HandEyeView*>& others = begin_after ? before : after;
    if (others.empty()) return;
    std::vector<RigidTransform> scanners, boards;
    for (const HandEyeView* view : others) {
      const RigidTransform robot = mount_from_stand(session_.mounted, view->base_from_flange);
      scanners.push_back(robot.after(places.stand_from_board).after(view->board.rig_from_board.inverse()));
      boards.push_back(robot.inverse().after(places.mount_from_rig).after(view->board.rig_from_board));
    }
    if (model_.scanner_moved) (begin_after ? state_.scanner : state_.scanner_after) = mean_of(scanners);
    if (model_.board_moved) (begin_after ? state_.board : state_.board_after) = mean_of(boards);
  }

  struct Cost {
    const Adjustment* adjustment;
    bool raw;
    template <class T>
    bool operator()(T const* const* unknowns, T* out) const {
      adjustment->residuals(unknowns[0], raw, out);
      return true;
    }
  };

  [[nodiscard]] std::unique_ptr<ceres::CostFunction> cost(bool raw) const {
    auto function = std::make_unique<ceres::DynamicAutoDiffCostFunction<Cost, 6>>(new Cost{this, raw});
    function->AddParameterBlock(at_.count);
    function->SetNumResiduals(rows());
    return function;
  }

  void adjust() {
    Eigen::VectorXd change = Eigen::VectorXd::Zero(at_.count);
    ceres::Problem problem;
    problem.AddResidualBlock(cost(false).release(), nullptr, change.data());
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.max_num_iterations = 50;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    state_.scanner = changed_by(state_.scanner, change.data());
    state_.board = changed_by(state_.board, change.data() + 6);
    if (model_.scanner_moved)
      state_.scanner_after = changed_by(state_.scanner_after, change.data() + at_.scanner_after);
    if (model_.board_moved) state_.board_after = changed_by(state_.board_after, change.data() + at_.board_after);
    if (model_.late) state_.late += change.segment(at_.late, state_.late.size());
    for (std::size_t i = 0; i < shared_.size(); ++i)
      state_.shared[shared_[i]] += change[at_.shared + static_cast<int>(i)];
  }

  void linearise() {
    const Eigen::VectorXd none = Eigen::VectorXd::Zero(at_.count);
    const double* const unknowns[] = {none.data()};
    off_.resize(rows());
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> slopes(rows(), at_.count);
    double* blocks[] = {slopes.data()};
    (void)cost(true)->Evaluate(unknowns, off_.data(), blocks);
    slopes_ = slopes;
    by_turn_.clear();
    for (const std::size_t i : counting_) by_turn_.push_back(by_robot_turn(i));
  }

  // How a small turn of the robot's pose about the flange moves the board that the model predicts.
  [[nodiscard]] Eigen::Matrix<double, 6, 3> by_robot_turn(std::size_t index) const {
    const HandEyeView& view = session_.views[index];
    const RigidTransform& robot = view.base_from_flange;
    const bool scanner_is_after = model_.scanner_moved && index >= *model_.scanner_moved;
    const bool board_is_after = model_.board_moved && index >= *model_.board_moved;
    const Eigen::Vector3d middle = (board_is_after ? state_.board_after : state_.board) * view.board.middle_mm;
    const Eigen::Matrix3d rig_from_mount =
        (scanner_is_after ? state_.scanner_after : state_.scanner).rotation.transpose();
    const bool arm = session_.mounted == Mounted::kArm;
    const Eigen::Matrix3d rig_from_base =
        arm ? Eigen::Matrix3d(rig_from_mount * robot.rotation.transpose()) : rig_from_mount;
    const Eigen::Vector3d lever =
        arm ? Eigen::Vector3d(middle - robot.translation) : Eigen::Vector3d(robot.rotation * middle);
    Eigen::Matrix<double, 6, 3> moves;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d unit = Eigen::Vector3d::Unit(axis);
      moves.col(axis) << rig_from_base * unit, rig_from_base * unit.cross(lever);
    }
    return moves;
  }

  /// The linear model at one level of noise.
  struct Level {
    double likelihood = 0;
    Eigen::Vector2d slope = Eigen::Vector2d::Zero();  // by the logarithms of the variances of place and turn
    Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
    Eigen::MatrixXd covariance;   // of all unknowns
    Eigen::MatrixXd widening[2];  // of the covariance, by these logarithms
    std::vector<Matrix6d> weights;
  };

  [[nodiscard]] Level level_at(const RobotNoise& noise) const {
    const int count = at_.count, known = static_cast<int>(known_.size());
    const auto views = static_cast<int>(counting_.size());
    const double corner = session_.corner_px * session_.corner_px;
    Level level;
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(count, count);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
    for (int i = 0; i < 12; ++i) normal(i, i) = std::pow(i % 6 < 3 ? kAnywhereRad : kAnywhereMm, -2);
    std::vector<Matrix6d> inverse;
    std::vector<std::array<Matrix6d, 2>> parts;
    double twice = (6 * views + known - count) * std::log(2 * std::numbers::pi);
    for (int i = 0; i < views; ++i) {
      Matrix6d place = Matrix6d::Zero();
      place.bottomRightCorner<3, 3>().diagonal().setConstant(noise.place_mm * noise.place_mm);
      const Matrix6d turn = noise.turn_rad * noise.turn_rad * by_turn_[i] * by_turn_[i].transpose();
      const Matrix6d seen = corner * session_.views[counting_[i]].board.normal.inverse();
      const Eigen::LLT<Matrix6d> whole(seen + place + turn);
      const Matrix6d lower = whole.matrixL();
      level.weights.push_back(lower.inverse());
      inverse.push_back(level.weights.back().transpose() * level.weights.back());
      parts.push_back({place, turn});
      twice += 2 * lower.diagonal().array().log().sum();
      const auto slopes = slopes_.middleRows(6 * i, 6);
      normal += slopes.transpose() * inverse[i] * slopes;
      right -= slopes.transpose() * inverse[i] * off_.segment<6>(6 * i);
    }
    for (int i = 0; i < known; ++i) {
      const auto slopes = slopes_.row(6 * views + i);
      const double weight = std::pow(known_[i], -2);
      normal += weight * slopes.transpose() * slopes;
      right -= weight * off_[6 * views + i] * slopes.transpose();
      twice += 2 * std::log(known_[i]);
    }
    const Eigen::LDLT<Eigen::MatrixXd> solver(normal);
    const Eigen::VectorXd left = off_ + slopes_ * solver.solve(right);
    level.covariance = solver.solve(Eigen::MatrixXd::Identity(count, count));
    twice += solver.vectorD().array().max(1e-300).log().sum();
    Eigen::MatrixXd spread[2] = {Eigen::MatrixXd::Zero(count, count), Eigen::MatrixXd::Zero(count, count)};
    for (int i = 0; i < views; ++i) {
      const auto slopes = slopes_.middleRows(6 * i, 6);
      const Eigen::MatrixXd weighted = inverse[i] * slopes;
      const Vector6d force = inverse[i] * left.segment<6>(6 * i);
      twice += left.segment<6>(6 * i).dot(force);
      for (int k = 0; k < 2; ++k) {
        spread[k] += weighted.transpose() * parts[i][k] * weighted;
        level.slope[k] += 0.5 * (force.dot(parts[i][k] * force) - (inverse[i] * parts[i][k]).trace());
        for (int l = 0; l < 2; ++l) {
          const Matrix6d both = parts[i][k] * inverse[i] * parts[i][l];
          level.information(k, l) +=
              0.5 * (inverse[i] * both).trace() - (level.covariance * weighted.transpose() * both * weighted).trace();
        }
      }
    }
    for (int i = 0; i < known; ++i) twice += std::pow(left[6 * views + i] / known_[i], 2);
    for (int k = 0; k < 2; ++k) {
      level.slope[k] += 0.5 * (level.covariance * spread[k]).trace();
      level.widening[k] = level.covariance * spread[k] * level.covariance;
      for (int l = 0; l < 2; ++l)
        level.information(k, l) += 0.5 * (level.covariance * spread[k] * level.covariance * spread[l]).trace();
    }
    level.likelihood = -0.5 * twice;
    const RobotNoise usual;
    const double beyond[] = {2 * std::log(noise.place_mm / usual.place_mm),
                             2 * std::log(noise.turn_rad / usual.turn_rad)};
    for (int k = 0; k < 2; ++k) {
      level.likelihood += log_normal(beyond[k], kNoiseSpread);
      level.slope[k] -= beyond[k] / (kNoiseSpread * kNoiseSpread);
      level.information(k, k) += std::pow(kNoiseSpread, -2);
    }
    return level;
  }

  // Fisher's scoring, with the step halved until the likelihood rises.
  void estimate_noise() {
    level_ = level_at(state_.noise);
    for (int step = 0; step < kNoiseSteps; ++step) {
      Eigen::Vector2d change = level_.information.ldlt().solve(level_.slope);
      if (!change.allFinite()) break;
      if (change.norm() > kNoiseStepMax) change *= kNoiseStepMax / change.norm();
      const double before = level_.likelihood;
      for (; change.norm() > kSettled; change /= 2) {
        const RobotNoise there{state_.noise.place_mm * std::exp(change[0] / 2),
                               state_.noise.turn_rad * std::exp(change[1] / 2)};
        Level next = level_at(there);
        if (!(next.likelihood > before)) continue;
        state_.noise = there;
        level_ = std::move(next);
        break;
      }
      if (level_.likelihood - before < kSettled) break;
    }
    weights_ = level_.weights;
  }

  [[nodiscard]] HandEyeFit result() {
    HandEyeFit fit;
    fit.places = {state_.scanner, state_.board};
    if (model_.scanner_moved) fit.mount_from_rig_after = state_.scanner_after;
    if (model_.board_moved) fit.stand_from_board_after = state_.board_after;
    fit.lateness.assign(state_.late.data(), state_.late.data() + state_.late.size());
    fit.shared = state_.shared;
    fit.noise = state_.noise;
    fit.covariance = level_.covariance.topLeftCorner<12, 12>();
    const double area = level_.covariance.diagonal().segment<3>(3).sum();
    const Eigen::Vector2d growth{level_.widening[0].diagonal().segment<3>(3).sum() / area,
                                 level_.widening[1].diagonal().segment<3>(3).sum() / area};
    fit.freedom = 2 / std::max(1e-9, growth.dot(level_.information.ldlt().solve(growth)));  // Satterthwaite
    fit.evidence = level_.likelihood;
    const double stray = std::log(kStrayShare) + 3 * (log_normal(0, kStrayMm) + log_normal(0, kStrayRad));
    fit.evidence += stray * static_cast<double>(model_.left_out.size());
    const bool arm = session_.mounted == Mounted::kArm;
    for (int i = 0; i < 3; ++i) {
      fit.evidence += log_normal(state_.scanner.translation[i], arm ? kHeldMm : kStandingMm);
      fit.evidence += log_normal(state_.board.translation[i], arm ? kStandingMm : kHeldMm);
    }
    for (std::size_t i = 0; i < session_.views.size(); ++i) {
      const bool scanner_is_after = model_.scanner_moved && i >= *model_.scanner_moved;
      const bool board_is_after = model_.board_moved && i >= *model_.board_moved;
      const Vector6d residual =
          residual_of(session_.views[i], cast<double>(session_.views[i].base_from_flange),
                      cast<double>(scanner_is_after ? state_.scanner_after : state_.scanner),
                      cast<double>(board_is_after ? state_.board_after : state_.board), state_.shared);
      fit.residuals.push_back({residual.head<3>(), residual.tail<3>()});
    }
    return fit;
  }

  const HandEyeSession& session_;
  const HandEyeModel& model_;
  Unknowns at_;
  std::vector<std::size_t> counting_;
  std::vector<double> known_;         // one standard deviation each
  std::vector<Eigen::Index> shared_;  // the shared errors that are unknown
  State state_;
  std::vector<Matrix6d> weights_;
  Eigen::VectorXd off_;
  Eigen::MatrixXd slopes_;
  std::vector<Eigen::Matrix<double, 6, 3>> by_turn_;
  Level level_;
};

}  // namespace

HandEyeFit fit_hand_eye(const HandEyeSession& session, const HandEyeModel& model) {
  return Adjustment(session, model).fit();
}

}  // namespace slsd
