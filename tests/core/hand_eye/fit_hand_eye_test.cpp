// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// Errors of simulated sessions, against the covariance that comes with them, and against OpenCV's five methods.
#include "core/hand_eye/fit_hand_eye.hpp"

#include <algorithm>
#include <cstdio>
#include <functional>
#include <numbers>

#include <gtest/gtest.h>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <opencv2/calib3d.hpp>

#include "core/hand_eye/hand_eye_verdict.hpp"
#include "tests/core/hand_eye/simulated_robot.hpp"

namespace slsd {
namespace {

constexpr double kDegreesOfRad = 180 / std::numbers::pi;
constexpr RobotNoise kGoodRobot{0.05, 0.02 / kDegreesOfRad}, kUsualRobot{0.1, 0.05 / kDegreesOfRad};

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

struct Off {
  double place_mm, turn_degrees;
};

Off off(const RigidTransform& found, const RigidTransform& truth) {
  return {(found.translation - truth.translation).norm(),
          kDegreesOfRad * Eigen::AngleAxisd(truth.rotation * found.rotation.transpose()).angle()};
}

/// Tells if the 95 % ellipse of a point one metre before the scanner holds the truth.
bool holds(const HandEyeFit& fit, const RigidTransform& truth) {
  const Eigen::Vector3d point(0, 0, 1000), lever = fit.places.mount_from_rig.rotation * point;
  Eigen::Matrix<double, 3, 6> by_change;
  by_change << 0, lever.z(), -lever.y(), 1, 0, 0, -lever.z(), 0, lever.x(), 0, 1, 0, lever.y(), -lever.x(), 0, 0, 0, 1;
  const Eigen::Matrix3d covariance = by_change * fit.covariance.topLeftCorner<6, 6>() * by_change.transpose();
  const Eigen::Vector3d error = truth * point - fit.places.mount_from_rig * point;
  return error.dot(covariance.inverse() * error) < ellipse_squared(fit.freedom);
}

void expect_musts(Mounted mounted, const RobotNoise& noise) {
  constexpr unsigned kSessions = 200;
  std::vector<double> places, turns;
  int inside = 0;
  for (unsigned seed = 0; seed < kSessions; ++seed) {
    SimulatedRobot robot;
    robot.mounted = mounted, robot.noise = noise;
    const SimulatedSession simulated = simulate(robot, 1000 + seed);
    const HandEyeFit fit = fit_hand_eye(simulated.session);
    const Off error = off(fit.places.mount_from_rig, simulated.places.mount_from_rig);
    places.push_back(error.place_mm), turns.push_back(error.turn_degrees);
    inside += holds(fit, simulated.places.mount_from_rig);
  }
  std::printf("%s, %.2f mm and %.2f°: medians %.3f mm and %.4f°, in the 95 %% ellipse %.1f %%\n",
              mounted == Mounted::kArm ? "arm" : "cell", noise.place_mm, kDegreesOfRad * noise.turn_rad, median(places),
              median(turns), 100.0 * inside / kSessions);
  EXPECT_LE(median(places), 0.4);
  EXPECT_LE(median(turns), 0.04);
  EXPECT_GE(inside, 0.90 * kSessions);
  EXPECT_LE(inside, 0.98 * kSessions);
}

TEST(FitHandEye, PlacesAScannerOnAGoodArm) {
  expect_musts(Mounted::kArm, kGoodRobot);
}

TEST(FitHandEye, PlacesAScannerOnAUsualArm) {
  expect_musts(Mounted::kArm, kUsualRobot);
}

TEST(FitHandEye, PlacesAScannerInACellWithAGoodArm) {
  expect_musts(Mounted::kCell, kGoodRobot);
}

TEST(FitHandEye, PlacesAScannerInACellWithAUsualArm) {
  expect_musts(Mounted::kCell, kUsualRobot);
}

cv::Mat to_matrix(const Eigen::Matrix3d& rotation) {
  cv::Mat matrix(3, 3, CV_64F);
  for (int i = 0; i < 9; ++i) matrix.at<double>(i / 3, i % 3) = rotation(i / 3, i % 3);
  return matrix;
}

cv::Mat to_column(const Eigen::Vector3d& place) {
  return cv::Mat(cv::Vec3d(place.x(), place.y(), place.z()), true);
}

/// OpenCV's result from the same poses and the same places of boards. In the cell it takes inverted poses.
RigidTransform by_opencv(const HandEyeSession& session, cv::HandEyeCalibrationMethod method) {
  std::vector<cv::Mat> robot_turns, robot_places, board_turns, board_places;
  for (const HandEyeView& view : session.views) {
    const RigidTransform robot =
        session.mounted == Mounted::kArm ? view.base_from_flange : view.base_from_flange.inverse();
    robot_turns.push_back(to_matrix(robot.rotation)), robot_places.push_back(to_column(robot.translation));
    board_turns.push_back(to_matrix(view.board.rig_from_board.rotation));
    board_places.push_back(to_column(view.board.rig_from_board.translation));
  }
  cv::Mat turn, place;
  cv::calibrateHandEye(robot_turns, robot_places, board_turns, board_places, turn, place, method);
  RigidTransform found;
  for (int i = 0; i < 9; ++i) found.rotation(i / 3, i % 3) = turn.at<double>(i / 3, i % 3);
  for (int i = 0; i < 3; ++i) found.translation[i] = place.at<double>(i);
  return found;
}

/// Medians of our errors over those of OpenCV's best method.
Off against_opencv(Mounted mounted, const RobotNoise& noise) {
  constexpr unsigned kSessions = 60;
  constexpr cv::HandEyeCalibrationMethod kMethods[] = {cv::CALIB_HAND_EYE_TSAI, cv::CALIB_HAND_EYE_PARK,
                                                       cv::CALIB_HAND_EYE_HORAUD, cv::CALIB_HAND_EYE_ANDREFF,
                                                       cv::CALIB_HAND_EYE_DANIILIDIS};
  std::vector<double> places, turns;
  std::vector<std::vector<double>> other_places(5), other_turns(5);
  for (unsigned seed = 0; seed < kSessions; ++seed) {
    SimulatedRobot robot;
    robot.mounted = mounted, robot.noise = noise;
    const SimulatedSession simulated = simulate(robot, 3000 + seed);
    const RigidTransform& truth = simulated.places.mount_from_rig;
    const Off ours = off(fit_hand_eye(simulated.session).places.mount_from_rig, truth);
    places.push_back(ours.place_mm), turns.push_back(ours.turn_degrees);
    for (std::size_t i = 0; i < 5; ++i) {
      const Off other = off(by_opencv(simulated.session, kMethods[i]), truth);
      other_places[i].push_back(other.place_mm), other_turns[i].push_back(other.turn_degrees);
    }
  }
  double best_place = 1e9, best_turn = 1e9;
  for (std::size_t i = 0; i < 5; ++i) {
    best_place = std::min(best_place, median(other_places[i]));
    best_turn = std::min(best_turn, median(other_turns[i]));
  }
  std::printf("%s: %.3f mm and %.4f°, OpenCV's best %.3f mm and %.4f°: shares %.2f and %.2f\n",
              mounted == Mounted::kArm ? "arm" : "cell", median(places), median(turns), best_place, best_turn,
              median(places) / best_place, median(turns) / best_turn);
  return {median(places) / best_place, median(turns) / best_turn};
}

TEST(FitHandEye, IsMoreExactThanTheFiveMethodsOfOpenCv) {
  for (const Mounted mounted : {Mounted::kArm, Mounted::kCell}) {
    for (const RobotNoise& noise : {kGoodRobot, kUsualRobot}) {
      const Off share = against_opencv(mounted, noise);
      EXPECT_LT(share.place_mm, mounted == Mounted::kArm ? 0.7 : 1.0 / 3);
      EXPECT_LT(share.turn_degrees, mounted == Mounted::kArm ? 0.9 : 0.6);
    }
  }
}

/// Median of the turn's error, degrees, if pictures, print and lens had no errors.
double turn_by_perfect_pictures(Mounted mounted, const RobotNoise& noise) {
  std::vector<double> turns;
  for (unsigned seed = 0; seed < 60; ++seed) {
    SimulatedRobot robot;
    robot.mounted = mounted, robot.noise = noise;
    robot.corner_px = 1e-3, robot.print_scale = 1e-7, robot.focal_px = 1e-4;
    const SimulatedSession simulated = simulate(robot, 3000 + seed);
    turns.push_back(
        off(fit_hand_eye(simulated.session).places.mount_from_rig, simulated.places.mount_from_rig).turn_degrees);
  }
  return median(turns);
}

TEST(FitHandEye, IsLimitedByTheRobotsOwnNoise) {
  for (const Mounted mounted : {Mounted::kArm, Mounted::kCell}) {
    for (const RobotNoise& noise : {kGoodRobot, kUsualRobot}) {
      const double turn = turn_by_perfect_pictures(mounted, noise);
      std::printf("%s, %.2f mm: turn by perfect pictures %.4f°\n", mounted == Mounted::kArm ? "arm" : "cell",
                  noise.place_mm, turn);
      EXPECT_GT(kDegreesOfRad * noise.turn_rad, turn);
      EXPECT_GT(turn, 0.25 * kDegreesOfRad * noise.turn_rad);
    }
  }
}

}  // namespace
}  // namespace slsd
