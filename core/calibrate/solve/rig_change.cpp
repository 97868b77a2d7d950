// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/solve/rig_change.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "core/calibrate/solve/point_residuals.hpp"
#include "core/calibrate/solve/pose_influence.hpp"
#include "core/geometry/robust.hpp"

namespace slsd {
namespace {

constexpr std::size_t kPosesOfSession = 5, kPosesOfPart = 2;
constexpr std::size_t kSymbolsOfView = 50;  // more than enough: a device that moved shifts all of them
constexpr int kRoundsOfSearch = 5;          // rounds of adjustment at each trial moment, which starts near the solution
constexpr std::size_t kMomentsTried = 24;   // first over the session; then those around the best

/// Threshold of the squared difference between both parts, in deviations of a device's six numbers. The mean is 6 for a
/// moment chosen in advance, and more for the likeliest of many. Ten times that is no chance.
constexpr double kDifferentMin = 60;
/// A change that moves symbols by less than this, in the projector, does not matter in practice.
constexpr double kNoticedPx = 0.1;
/// Poses with errors this much above the usual are themselves wrong, and are excluded.
constexpr double kWrongPose = 3;
constexpr double kWrongShare = 0.34;  // largest share of wrong poses
/// Excess of unexplained error above which one of two explanations is rejected.
constexpr double kClearlyWorse = 12;

/// Keeps every nth symbol and marks no outliers: points that lie off are evidence of the change.
Observations thinned(const Observations& observations) {
  Observations few = observations;
  std::erase_if(few.poses, [](const PoseObservation& pose) { return pose.subject != PoseSubject::kBoard; });
  for (PoseObservation& pose : few.poses) {
    for (PoseView& view : pose.views) {
      const std::size_t step = std::max<std::size_t>(1, view.symbols.size() / kSymbolsOfView);
      std::size_t i = 0;
      std::erase_if(view.symbols, [&](const ProjectedPoint&) { return i++ % step != 0; });
      for (ProjectedPoint& symbol : view.symbols) symbol.outlying = false;
      for (BoardPoint& corner : view.corners) corner.outlying = false;
    }
  }
  return few;
}

/// A session as one rig or as two, adjusted.
struct Model {
  RigModel rig;
  BundleOptions options;
  double cost = std::numeric_limits<double>::infinity();
};

/// Median error of its symbols, in their own deviations.
double usual_error(const PoseObservation& pose, const RigModel& rig, std::size_t index) {
  std::vector<double> errors;
  const RigModel then = rig.as_of(index);
  for (const PoseView& view : pose.views) {
    const ViewResiduals residuals = residuals_of(view, then, rig.rig_from_board[index], pose.subject);
    for (std::size_t i = 0; i < view.symbols.size(); ++i) {
      errors.push_back(residuals.symbols_px[i].norm() / view.symbols[i].sigma_px);
    }
    if (view.camera == 0) continue;
    for (const Eigen::Vector2d& off : residuals.corners_px) errors.push_back(off.norm() / view.symbols[0].sigma_px);
  }
  return median_of(std::move(errors));
}

std::vector<double> usual_errors(const Observations& seen, const RigModel& rig) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < seen.poses.size(); ++i) errors.push_back(usual_error(seen.poses[i], rig, i));
  return errors;
}

RigModel split_at(const RigModel& rig, std::size_t first_pose) {
  RigModel split = rig;
  MovedDevices& moved = split.moved.emplace();
  moved.first_pose = first_pose;
  moved.projector = rig.projector.device_from_rig;
  for (const DeviceModel& camera : rig.cameras) moved.cameras.push_back(camera.device_from_rig);
  return split;
}

/// Adjusts until the assumed noise of the symbols equals the remaining noise.
Model adjusted(const Observations& seen, BundleOptions options, RigModel rig, int rounds = 2) {
  constexpr double kSigmaOfDistance = 1 / 1.1774;  // standard deviation over the median distance in a plane
  Model model{std::move(rig), std::move(options)};
  for (int round = 0; round < rounds; ++round) {
    const auto adjusted = adjust(seen, model.options, model.rig);
    if (!adjusted) return {std::move(model.rig), model.options};
    model.cost = adjusted->cost;
    if (round + 1 < rounds) {
      model.options.symbol_sigma_factor = std::max(kSigmaOfDistance * median_of(usual_errors(seen, model.rig)), 1e-3);
    }
  }
  return model;
}

/// The moment at which two rigs explain the poses best.
std::size_t most_likely_moment(const Observations& seen, const BundleOptions& options, const RigModel& rig) {
  const std::size_t last = seen.poses.size() - kPosesOfPart;
  std::size_t best = kPosesOfPart;
  double least = std::numeric_limits<double>::infinity();
  BundleOptions quick = options;
  quick.iterations_max = kRoundsOfSearch;
  const auto attempt = [&](std::size_t moment) {
    const double cost = adjusted(seen, quick, split_at(rig, moment), 1).cost;
    if (cost < least) least = cost, best = moment;
  };
  const std::size_t step = (last - kPosesOfPart) / kMomentsTried + 1;
  for (std::size_t moment = kPosesOfPart; moment <= last; moment += step) attempt(moment);
  const std::size_t coarse = best;
  for (std::size_t moment = coarse + 1 - std::min(step, coarse - 1); moment < coarse + step && moment <= last;
       ++moment) {
    if (moment != coarse && moment >= kPosesOfPart) attempt(moment);
  }
  return best;
}

/// The difference between a device's two places and its covariance, in the order of MotionVector.
struct Difference {
  int device;
  Eigen::Matrix<double, 6, 1> by;
  Eigen::Matrix<double, 6, 6> covariance;

  [[nodiscard]] double squared() const { return by.dot(covariance.ldlt().solve(by)); }
};

std::vector<Difference> differences(const Model& model, const BundleEquations& equations,
                                    const PoseInfluence& influence) {
  std::vector<Difference> all;
  const auto column_of = [&](SharedParameter::Kind kind, int device) -> Eigen::Index {
    for (std::size_t i = 0; i < equations.shared.size(); ++i) {
      if (equations.shared[i].kind == kind && equations.shared[i].device == device) return static_cast<Eigen::Index>(i);
    }
    return -1;
  };
  for (int device = -1; device < static_cast<int>(model.rig.cameras.size()); ++device) {
    const Eigen::Index before = column_of(SharedParameter::Kind::kMotion, device),
                       after = column_of(SharedParameter::Kind::kMovedTo, device);
    if (before < 0 || after < 0) continue;
    const auto camera = static_cast<std::size_t>(std::max(device, 0));
    const MotionVector& was =
        device < 0 ? model.rig.projector.device_from_rig : model.rig.cameras[camera].device_from_rig;
    const MotionVector& is = device < 0 ? model.rig.moved->projector : model.rig.moved->cameras[camera];
    Difference& difference = all.emplace_back();
    difference.device = device;
    for (std::size_t i = 0; i < 6; ++i) difference.by(static_cast<Eigen::Index>(i)) = is[i] - was[i];
    const Eigen::MatrixXd& c = influence.covariance;
    const Eigen::Matrix<double, 6, 6> across = c.block<6, 6>(before, after);
    difference.covariance = c.block<6, 6>(before, before) + c.block<6, 6>(after, after) - across - across.transpose();
  }
  return all;
}

/// A device that turns about its own centre stays in place for the other one. Squared shift of the camera's place, seen
/// from the projector, in deviations.
double shift_of_own_place(const Difference& difference) {
  const Eigen::Matrix3d covariance = difference.covariance.bottomRightCorner<3, 3>();
  const Eigen::Vector3d by = difference.by.tail<3>();
  return by.dot(covariance.ldlt().solve(by));
}

/// The same for the projector's place, seen from the camera.
double shift_in_rig(const Difference& difference, const MotionVector& was) {
  const auto place = [](const Eigen::Matrix<double, 6, 1>& m) {
    const RigidTransform motion = to_motion({m(0), m(1), m(2), m(3), m(4), m(5)});
    return Eigen::Vector3d(-motion.rotation.transpose() * motion.translation);
  };
  Eigen::Matrix<double, 6, 1> from;
  for (std::size_t i = 0; i < 6; ++i) from(static_cast<Eigen::Index>(i)) = was[i];
  Eigen::Matrix<double, 3, 6> slope;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const double step = i < 3 ? 1e-6 : 1e-3;
    Eigen::Matrix<double, 6, 1> changed = from;
    changed(i) += step;
    slope.col(i) = (place(changed) - place(from)) / step;
  }
  const Eigen::Vector3d by = place(from + difference.by) - place(from);
  const Eigen::Matrix3d covariance = slope * difference.covariance * slope.transpose();
  return by.dot(covariance.ldlt().solve(by));
}

std::string camera_text(const Observations& seen, std::size_t camera) {
  return seen.cameras.size() == 1 ? "the camera" : "camera " + seen.cameras[camera].name;
}

/// Names the device that moved, by finding the devices that stayed in place.
std::string device_text(const std::vector<Difference>& all, const Observations& seen, const RigModel& rig) {
  if (all.size() == 1) {
    const MotionVector& was = rig.projector.device_from_rig;
    const double by_camera = shift_of_own_place(all[0]), by_projector = shift_in_rig(all[0], was);
    if (by_camera + kClearlyWorse < by_projector) return camera_text(seen, 0);
    if (by_projector + kClearlyWorse < by_camera) return "the projector";
    return camera_text(seen, 0) + " or the projector";
  }
  std::vector<int> moved;
  for (const Difference& one : all) {
    if (one.squared() > kDifferentMin) moved.push_back(one.device);
  }
  if (moved.size() == all.size()) return camera_text(seen, 0);
  std::string text;
  for (const int device : moved) {
    text += (text.empty() ? "" : " and ") +
            (device < 0 ? "the projector" : camera_text(seen, static_cast<std::size_t>(device)));
  }
  return text.empty() ? "one of the devices" : text;
}

std::string size_text(const Difference& difference, const MotionVector& was) {
  MotionVector is = was;
  for (std::size_t i = 0; i < 6; ++i) is[i] += difference.by(static_cast<Eigen::Index>(i));
  const double degrees =
      Eigen::AngleAxisd(to_motion(is).rotation * to_motion(was).rotation.transpose()).angle() * 180 / std::numbers::pi;
  const double mm = difference.by.tail<3>().norm();
  const double mm_sigma = std::sqrt(difference.covariance.bottomRightCorner<3, 3>().trace());
  return mm > 3 * mm_sigma && mm > 0.1 ? fmt::format("{:.2f} degrees and {:.1f} mm", degrees, mm)
                                       : fmt::format("{:.2f} degrees", degrees);
}

/// Median error of the second part's symbols, in the projector, under the first part's rig.
double moved_symbols_px(const Observations& seen, const Model& model) {
  RigModel before = model.rig;
  before.moved.reset();
  std::vector<double> off;
  for (std::size_t i = model.rig.moved->first_pose; i < seen.poses.size(); ++i) {
    for (const PoseView& view : seen.poses[i].views) {
      const auto residuals = residuals_of(view, before, model.rig.rig_from_board[i]);
      for (const Eigen::Vector2d& residual : residuals.symbols_projector_px) off.push_back(residual.norm());
      if (view.camera == 0) continue;
      for (const Eigen::Vector2d& residual : residuals.corners_px) off.push_back(residual.norm());
    }
  }
  return median_of(std::move(off));
}

/// Tells whether boards that moved between their two pictures explain the smaller part better than a moved device. Each
/// board then has its own plane for its symbols, three numbers a pose, instead of the device's six.
bool boards_explain_better(const Observations& seen, const Model& split, const RigModel& one_rig) {
  const std::size_t first = split.rig.moved->first_pose, count = seen.poses.size();
  const bool second_part = count - first <= first;
  RigModel boards = one_rig;
  for (std::size_t i = second_part ? first : 0; i < (second_part ? count : first); ++i) {
    boards.rig_from_lit[i] = boards.rig_from_board[i];
  }
  const double points = static_cast<double>(count * kSymbolsOfView);
  const auto numbers = static_cast<double>(3 * boards.rig_from_lit.size());
  const auto devices = static_cast<double>(6 * one_rig.cameras.size());
  const Model moved_boards = adjusted(seen, split.options, std::move(boards), 1);
  return 2 * moved_boards.cost + numbers * std::log(points) < 2 * split.cost + devices * std::log(points);
}

/// The pose that is off most under a model, if any pose is itself wrong.
std::optional<std::size_t> wrong_pose(const Observations& seen, const RigModel& rig) {
  const std::vector<double> errors = usual_errors(seen, rig);
  const auto worst = std::ranges::max_element(errors);
  if (*worst < kWrongPose * median_of(errors)) return std::nullopt;
  return static_cast<std::size_t>(worst - errors.begin());
}

}  // namespace

std::optional<RigChange> find_rig_change(const Observations& observations, const BundleOptions& options,
                                         const RigModel& rig) {
  Observations seen = thinned(observations);
  RigModel one_rig = rig;
  one_rig.rig_from_board.resize(seen.poses.size());
  const auto wrong_max = static_cast<std::size_t>(kWrongShare * static_cast<double>(seen.poses.size()));
  std::vector<std::size_t> original(seen.poses.size());
  for (std::size_t i = 0; i < original.size(); ++i) original[i] = i;
  for (std::size_t left_out = 0; left_out <= wrong_max && seen.poses.size() >= kPosesOfSession; ++left_out) {
    const Model split = adjusted(seen, options, split_at(one_rig, most_likely_moment(seen, options, one_rig)), 3);
    if (const auto wrong = wrong_pose(seen, split.rig)) {
      const auto at = static_cast<std::ptrdiff_t>(*wrong);
      seen.poses.erase(seen.poses.begin() + at), original.erase(original.begin() + at);
      one_rig.rig_from_board.erase(one_rig.rig_from_board.begin() + at);
      if (!adjust(seen, options, one_rig)) return std::nullopt;
      continue;
    }
    const auto equations = linearise(seen, split.options, split.rig);
    if (!equations) return std::nullopt;
    const auto influence = find_influence(*equations);
    if (!influence) return std::nullopt;
    const std::vector<Difference> all = differences(split, *equations, *influence);
    const auto most = std::ranges::max_element(all, {}, [](const Difference& one) { return one.squared(); });
    if (most == all.end() || !(most->squared() > kDifferentMin)) return std::nullopt;
    if (moved_symbols_px(seen, split) < kNoticedPx || boards_explain_better(seen, split, one_rig)) return std::nullopt;
    const std::size_t first = split.rig.moved->first_pose;
    const MotionVector& was = most->device < 0
                                  ? split.rig.projector.device_from_rig
                                  : split.rig.cameras[static_cast<std::size_t>(most->device)].device_from_rig;
    return RigChange{original[first],
                     fmt::format("{} moved between {} and {}, by {}", device_text(all, seen, split.rig),
                                 seen.poses[first - 1].name, seen.poses[first].name, size_text(*most, was))};
  }
  return std::nullopt;
}

}  // namespace slsd
