// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/geometry/robot_pose.hpp"

#include <cmath>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

namespace slsd {
namespace {

using testing::HasSubstr;

RigidTransform read(const char* notation, const std::vector<double>& numbers) {
  const auto pose = read_robot_pose(numbers, *pose_notation(notation));
  EXPECT_TRUE(pose) << notation;
  return pose.value_or(RigidTransform{});
}

void expect_pose(const RigidTransform& is, const Eigen::Matrix3d& rotation, const Eigen::Vector3d& place) {
  EXPECT_LT((is.rotation - rotation).norm(), 1e-8) << is.rotation;
  EXPECT_LT((is.translation - place).norm(), 1e-9) << is.translation.transpose();
}

Eigen::Matrix3d rows(std::initializer_list<double> numbers) {
  Eigen::Matrix3d matrix;
  int i = 0;
  for (const double number : numbers) matrix(i / 3, i % 3) = number, ++i;
  return matrix;
}

// The matrices are products of OpenCV's Rodrigues() about single axes.
TEST(ReadRobotPose, ReadsTheNotationOfEachRobot) {
  const Eigen::Vector3d place(400, -250.5, 812);
  expect_pose(
      read("ur", {0.4, -0.2505, 0.812, 0.3, -1.2, 2.0}),
      rows({-0.6761172459106027, -0.7150638736881626, -0.17762073732630718, 0.49322482643528864, -0.26016903231146415,
            -0.8300851433521719, 0.5473524827477636, -0.648841838333654, 0.5285920245876428}),
      place);
  const Eigen::Matrix3d zyx =
      rows({0.6634139481689384, 0.10504046113295197, 0.7408430568614907, 0.38302222155948895, 0.8028723374794714,
            -0.456825992585671, -0.6427876096865393, 0.5868240888334652, 0.49240387650610407});
  expect_pose(read("kuka", {400, -250.5, 812, 30, 40, 50}), zyx, place);
  expect_pose(read("fanuc", {400, -250.5, 812, 50, 40, 30}), zyx, place);
  expect_pose(
      read("staubli", {400, -250.5, 812, 30, 40, 50}),
      rows({0.49240387650610407, -0.5868240888334652, 0.6427876096865393, 0.8700019037522058, 0.3104684609733675,
            -0.38302222155948895, 0.02520138625748726, 0.7478280708194912, 0.6634139481689384}),
      place);
  expect_pose(
      read("kawasaki", {400, -250.5, 812, 30, 40, 50}),
      rows({0.04341204441673267, -0.8295983733257066, 0.5566703992264194, 0.9096158864219904, 0.2632583548096869,
            0.32139380484326957, -0.4131759111665348, 0.49240387650610395, 0.766044443118978}),
      place);
  const double w = 0.860042173697679, x = 0.3033717744712595, y = 0.4021984935341096, z = 0.08080468869083997;
  expect_pose(read("abb", {400, -250.5, 812, w, x, y, z}), zyx, place);
  expect_pose(read("ros", {0.4, -0.2505, 0.812, x, y, z, w}), zyx, place);
  const auto matrix = [&](double unit) {
    return std::vector<double>{zyx(0, 0), zyx(0, 1), zyx(0, 2), 400 * unit,     //
                               zyx(1, 0), zyx(1, 1), zyx(1, 2), -250.5 * unit,  //
                               zyx(2, 0), zyx(2, 1), zyx(2, 2), 812 * unit,     //
                               0,         0,         0,         1};
  };
  expect_pose(read("matrix", matrix(1)), zyx, place);
  expect_pose(read("matrix-m", matrix(0.001)), zyx, place);
}

TEST(ReadRobotPose, ReadsWhatRobotNumbersWrites) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (const std::string& name : pose_notation_names()) {
    const PoseNotation notation = *pose_notation(name);
    EXPECT_EQ(name_of(notation), name);
    for (int i = 0; i < 50; ++i) {
      const double angle = normal(random);
      const Eigen::Vector3d axis = Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
      const RigidTransform pose{Eigen::AngleAxisd(angle, axis).toRotationMatrix(),
                                {500 * normal(random), 500 * normal(random), 500 * normal(random)}};
      const std::vector<double> numbers = robot_numbers(pose, notation);
      EXPECT_EQ(numbers.size(), notation.count());
      expect_pose(*read_robot_pose(numbers, notation), pose.rotation, pose.translation);
    }
  }
}

TEST(ReadRobotPose, RefusesWhatIsNoPose) {
  const auto message = [](const char* notation, const std::vector<double>& numbers) {
    const auto pose = read_robot_pose(numbers, *pose_notation(notation));
    return pose ? std::string("no error") : pose.error().message;
  };
  EXPECT_THAT(message("kuka", {1, 2, 3, 4, 5}), HasSubstr("has 5 numbers instead of 6: x y z in mm, A B C in degrees"));
  EXPECT_THAT(message("ur", {1, 2, 3, 4, 5, std::numeric_limits<double>::quiet_NaN()}), HasSubstr("not finite"));
  EXPECT_THAT(message("abb", {1, 2, 3, 1, 0.2, 0, 0}), HasSubstr("length 1.020 instead of 1"));
  EXPECT_THAT(message("matrix", {1, 0, 0, 5, 0, 1, 0, 5, 0, 0, -1, 5, 0, 0, 0, 1}), HasSubstr("mirrors"));
  EXPECT_THAT(message("matrix", {1, 0, 0, 5, 0, 2, 0, 5, 0, 0, 1, 5, 0, 0, 0, 1}), HasSubstr("no rotation"));
  EXPECT_THAT(message("matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 5, 5, 1}), HasSubstr("last column"));
}

TEST(CheckReach, RefusesPlacesOfAnotherUnit) {
  const auto message = [](double x_mm, double y_mm, double z_mm) {
    const auto reached = check_reach({Eigen::Matrix3d::Identity(), {x_mm, y_mm, z_mm}});
    return reached ? std::string() : reached.error().message;
  };
  for (const double sign : {-1.0, 1.0}) {
    EXPECT_EQ(message(0, 0, 10 * sign), "");
    EXPECT_EQ(message(0, 12'000 * sign, 16'000), "");
    EXPECT_EQ(message(6 * sign, 0, 7.9), "puts the flange 9.92 mm from the robot's base, which must be 10 mm to 20 m");
    EXPECT_THAT(message(12'000, 0, 16'001 * sign), HasSubstr("puts the flange 2e+04 mm from the robot's base"));
  }
  EXPECT_THAT(message(0, 0, 0), HasSubstr("puts the flange 0 mm"));
}

TEST(PoseNotation, ListsTheNames) {
  const auto unknown = pose_notation("yaskawa");
  ASSERT_FALSE(unknown);
  EXPECT_THAT(to_string(unknown.error()), HasSubstr("yaskawa: is no notation of poses: ur, ur-pendant, kuka, fanuc"));
}

}  // namespace
}  // namespace slsd
