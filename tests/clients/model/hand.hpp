// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "bumpy_ball.hpp"

namespace slsd::model {

inline Eigen::Matrix3f turned(float degrees) {
  return Eigen::AngleAxisf(degrees * 3.14159265F / 180, Eigen::Vector3f::UnitY()).toRotationMatrix();
}

/// Distance to a rod with round ends.
inline float rod(const Eigen::Vector3f& at, const Eigen::Vector3f& from, const Eigen::Vector3f& to, float radius) {
  const Eigen::Vector3f along = to - from;
  const float share = std::clamp((at - from).dot(along) / along.squaredNorm(), 0.0F, 1.0F);
  return (at - from - share * along).norm() - radius;
}

/// The smaller of two distances, rounded where they meet.
inline float joined(float a, float b, float round_mm) {
  const float share = std::clamp(0.5F + 0.5F * (b - a) / round_mm, 0.0F, 1.0F);
  return b + share * (a - b) - round_mm * share * (1 - share);
}

/// A hand that holds the ball at its foot from the camera's side: a palm of 8 cm, four fingers beside one another on
/// the ball, a wrist that leads down. About the ball's middle; y points down.
inline float hand(const Eigen::Vector3f& at) {
  if (at.norm() < 40) return 20;  // inside of the ball
  const auto on_ball = [](float side_degrees, float down_degrees, float far_mm) {
    const float side = side_degrees * 3.14159265F / 180, down = down_degrees * 3.14159265F / 180;
    return Eigen::Vector3f(far_mm * std::sin(side) * std::cos(down), far_mm * std::sin(down),
                           -far_mm * std::cos(side) * std::cos(down));
  };
  constexpr float kRoundMm = 6;
  float off = joined(rod(at, on_ball(-30, 58, 62), on_ball(30, 58, 62), 11), rod(at, {0, 60, -30}, {0, 110, -50}, 15),
                     3 * kRoundMm);
  for (const float side : {-33.0F, -11.0F, 11.0F, 33.0F})
    off = joined(off,
                 joined(rod(at, on_ball(side, 55, 61), on_ball(side, 40, 58), 6.5F),
                        rod(at, on_ball(side, 40, 58), on_ball(side, 22, 57), 6), 3),
                 kRoundMm);
  return 0.9F * off;
}

/// A camera that sees the ball's surroundings: 210 mm at its middle.
inline Calibration wide_calibration() {
  Calibration calibration = test_calibration();
  calibration.cameras[0].lens = {.width_px = 320, .height_px = 280, .fx = 900, .fy = 900, .cx = 159.5, .cy = 139.5};
  return calibration;
}

/// A dense cloud as PLY.
inline std::string ply_of(const std::vector<DensePoint>& points) {
  std::string ply =
      "ply\nformat binary_little_endian 1.0\ncomment units mm\nelement vertex " + std::to_string(points.size()) + "\n";
  for (const char* name : {"float x", "float y", "float z", "float sigma_mm", "uchar intensity", "uchar camera"})
    ply += std::string("property ") + name + "\n";
  ply += "end_header\n";
  for (const DensePoint& point : points) {
    const std::array numbers{point.place_mm.x(), point.place_mm.y(), point.place_mm.z(), point.sigma_mm};
    ply.append(reinterpret_cast<const char*>(numbers.data()), sizeof(numbers));
    ply.push_back(static_cast<char>(point.intensity));
    ply.push_back('\0');
  }
  return ply;
}

/// Distance to the bumpy ball's true surface, mm, in the ball's frame.
inline float off_ball_mm(const Eigen::Vector3f& at) {
  Eigen::Vector3f slope;
  for (int axis = 0; axis < 3; ++axis)
    slope[axis] =
        (bumpy_ball(at + 0.1F * Eigen::Vector3f::Unit(axis)) - bumpy_ball(at - 0.1F * Eigen::Vector3f::Unit(axis))) /
        0.2F;
  return bumpy_ball(at) / slope.norm();
}

}  // namespace slsd::model
