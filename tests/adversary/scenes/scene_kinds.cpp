// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/adversary/scenes/scene_kinds.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

namespace slsd::adversary {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kNearMm = 1550, kFarMm = 2400;  // within the working depths of all decoders
constexpr double kReachMm = 320;                 // from the middle of what the camera sees to its corners
constexpr double kLongMm = 1000;                 // beyond what the camera sees

/// Turns about the optical axis, then about the turned x and y axes.
Matrix3d turned(double roll_deg, double tilt_deg, double slant_deg) {
  constexpr double kRad = std::numbers::pi / 180;
  return (Eigen::AngleAxisd(roll_deg * kRad, Vector3d::UnitZ()) *
          Eigen::AngleAxisd(tilt_deg * kRad, Vector3d::UnitX()) *
          Eigen::AngleAxisd(slant_deg * kRad, Vector3d::UnitY()))
      .toRotationMatrix();
}

/// Draws one number after the other: compilers evaluate arguments in an order of their own.
Matrix3d tilted(Random& random, double most_deg) {
  const double tilt = uniform(random, -most_deg, most_deg), slant = uniform(random, -most_deg, most_deg);
  return turned(0, tilt, slant);
}
Matrix3d turned_and_tilted(Random& random, double most_deg) {
  const Matrix3d roll = turned(uniform(random, 0, 180), 0, 0);
  return roll * tilted(random, most_deg);
}

double any_albedo(Random& random) {
  return log_uniform(random, 0.35, 1);
}

/// A place that the camera sees, at this depth.
Vector3d somewhere(Random& random, double depth_mm) {
  constexpr double kHalfWidth = 0.118, kHalfHeight = 0.09;  // of the depth
  return {uniform(random, -kHalfWidth, kHalfWidth) * depth_mm, uniform(random, -kHalfHeight, kHalfHeight) * depth_mm,
          depth_mm};
}

/// Begins a scene with a wall that fills the image.
DepthScene with_wall(Random& random, double depth_mm) {
  DepthScene scene;
  scene.begin_part(any_albedo(random));
  scene.add(Plate{{0, 0, depth_mm}, tilted(random, 12), {kLongMm, kLongMm}});
  return scene;
}

DepthScene lay_slats(Random& random, double symbol_mm) {
  const double depth = uniform(random, 1650, 2050), width = symbol_mm * uniform(random, 1, 5);
  DepthScene scene = with_wall(random, std::min(kFarMm - 60, depth + log_uniform(random, 60, 600)));
  const double roll = either_sign(random, uniform(random, 5, 60)), tilt = uniform(random, -50, 50);
  const Matrix3d slat = turned(roll, tilt, 0), blind = turned(roll, uniform(random, -15, 15), 0);
  const double pitch = width * (std::cos(tilt * std::numbers::pi / 180) + log_uniform(random, 0.15, 1.5));
  const bool uneven = whole(random, 0, 1) == 1;
  for (double at = -kReachMm + uniform(random, 0, pitch); at < kReachMm; at += pitch) {
    scene.begin_part(any_albedo(random));
    const Matrix3d own = uneven ? Matrix3d(slat * tilted(random, 5)) : slat;
    scene.add(Plate{Vector3d(0, 0, depth) + at * blind.col(1), own, {kLongMm, width / 2}});
  }
  return scene;
}

void add_fence(Random& random, double symbol_mm, double roll, double depth, bool uneven, DepthScene& scene) {
  const double gap = log_uniform(random, 0.3, 2);
  for (double at = -kReachMm; at < kReachMm;) {
    const double width = symbol_mm * uniform(random, 1, 6);
    const double own = uneven ? uniform(random, kNearMm, kFarMm - 150) : depth;
    const Matrix3d axes = turned(roll, 0, 0);
    scene.begin_part(any_albedo(random));
    scene.add(Plate{Vector3d(0, 0, own) + (at + width / 2) * axes.col(1), axes, {kLongMm, width / 2}});
    at += width * (1 + (uneven ? 0.2 * gap : gap));
  }
}

DepthScene lay_pickets(Random& random, double symbol_mm) {
  DepthScene scene = with_wall(random, uniform(random, 2150, kFarMm - 50));
  const double roll = either_sign(random, uniform(random, 20, 70)), depth = uniform(random, kNearMm, 2050);
  const bool uneven = whole(random, 0, 1) == 1, crossed = whole(random, 0, 2) == 0;
  add_fence(random, symbol_mm, roll, depth, uneven, scene);
  const double crossing = uniform(random, 50, 90), behind = uniform(random, 5, 40);
  if (crossed) add_fence(random, symbol_mm, roll + crossing, depth + behind, false, scene);
  return scene;
}

DepthScene lay_leaves(Random& random, double symbol_mm) {
  const double wall = uniform(random, 2000, kFarMm - 50);
  DepthScene scene = with_wall(random, wall);
  const double largest = symbol_mm * log_uniform(random, 2, 6);
  for (int leaves = whole(random, 25, 120); leaves > 0; --leaves) {
    const double half = largest * uniform(random, 0.4, 1);
    scene.begin_part(any_albedo(random));
    scene.add(Plate{somewhere(random, uniform(random, kNearMm, wall - 30)),
                    turned_and_tilted(random, 50),
                    {half, half * uniform(random, 0.3, 0.8)},
                    Outline::kEllipse});
  }
  return scene;
}

/// A wire from left to right that swings up and down and to and fro.
void add_cable(Random& random, double radius, double depth, DepthScene& scene) {
  constexpr int kPieces = 40;
  constexpr double kTurn = 2 * std::numbers::pi;
  const Vector3d middle = somewhere(random, depth);
  const Matrix3d axes = turned(uniform(random, 0, 180), 0, 0);
  const double swing = uniform(random, 5, 90), swings = uniform(random, 0.5, 3), phase = uniform(random, 0, 1),
               sway = uniform(random, 0, 60), sways = uniform(random, 0.3, 2);
  Vector3d from;
  scene.begin_part(any_albedo(random));
  for (int i = 0; i <= kPieces; ++i) {
    const double along = static_cast<double>(i) / kPieces - 0.5;
    const Vector3d to =
        middle + axes * Vector3d(2 * kReachMm * along, swing * std::sin(kTurn * (swings * along + phase)),
                                 sway * std::sin(kTurn * sways * along));
    scene.add(Ball{to, radius});
    if (i > 0) scene.add(Tube{from, to, radius});
    from = to;
  }
}

DepthScene lay_cables(Random& random, double symbol_mm) {
  const double wall = uniform(random, 1900, kFarMm - 50);
  DepthScene scene = with_wall(random, wall);
  for (int cables = whole(random, 4, 14); cables > 0; --cables) {
    const double radius = symbol_mm * log_uniform(random, 0.2, 1.5);
    add_cable(random, radius, uniform(random, kNearMm + 100, wall - 80), scene);
  }
  return scene;
}

/// Boards of one thickness on a wall: side by side as a terrace, or across each other.
DepthScene lay_small_steps(Random& random, double symbol_mm) {
  const Vector3d middle(0, 0, uniform(random, 1750, 2250));
  const Matrix3d wall = tilted(random, 20);
  const double step = uniform(random, 15, 30), roll = uniform(random, 0, 180);
  const bool terrace = whole(random, 0, 1) == 1;
  DepthScene scene;
  scene.begin_part(any_albedo(random));
  scene.add(Plate{middle, wall, {kLongMm, kLongMm}});
  if (terrace) {
    double at = -kReachMm;
    for (int level = 1; at < kReachMm; level = std::clamp(level + (whole(random, 0, 1) == 0 ? -1 : 1), 0, 5)) {
      const double width = symbol_mm * uniform(random, 1, 8), high = std::max(level * step, 0.1);
      const Matrix3d axes = wall * turned(roll, 0, 0);
      scene.add_box(middle + axes * Vector3d(0, at + width / 2, -high / 2), axes, {kLongMm, width / 2, high / 2},
                    any_albedo(random));
      at += width;
    }
    return scene;
  }
  for (int boards = whole(random, 8, 30); boards > 0; --boards) {
    const double high = step * whole(random, 1, 3);
    const Vector3d at{uniform(random, -250, 250), uniform(random, -190, 190), -high / 2};
    const Vector3d half{symbol_mm * uniform(random, 1, 8), symbol_mm * uniform(random, 0.5, 4), high / 2};
    const Matrix3d axes = wall * turned(uniform(random, 0, 180), 0, 0);
    scene.add_box(middle + wall * at, axes, half, any_albedo(random));
  }
  return scene;
}

DepthScene lay_perforated_plate(Random& random, double symbol_mm) {
  const double depth = uniform(random, kNearMm + 50, 2050);
  DepthScene scene = with_wall(random, std::min(kFarMm - 60, depth + log_uniform(random, 60, 600)));
  const double radius = symbol_mm * log_uniform(random, 0.5, 4);
  scene.begin_part(any_albedo(random));
  scene.add(Plate{somewhere(random, depth),
                  turned_and_tilted(random, 12),
                  {kLongMm, kLongMm},
                  Outline::kHoles,
                  radius,
                  radius * uniform(random, 2.3, 4.5)});
  return scene;
}

DepthScene lay_balls(Random& random, double symbol_mm) {
  const double wall = uniform(random, 2000, kFarMm - 50);
  DepthScene scene = with_wall(random, wall);
  const double largest = symbol_mm * log_uniform(random, 3, 10);
  for (int balls = whole(random, 5, 30); balls > 0; --balls) {
    scene.begin_part(any_albedo(random));
    const double depth = uniform(random, kNearMm + 100, wall - 20);
    scene.add(Ball{somewhere(random, depth), largest * uniform(random, 0.3, 1)});
  }
  return scene;
}

DepthScene lay_pile(Random& random, double symbol_mm) {
  const double wall = uniform(random, 2100, kFarMm - 50), high = uniform(random, 100, 450);
  DepthScene scene = with_wall(random, wall);
  for (int boxes = whole(random, 10, 40); boxes > 0; --boxes) {
    const Vector3d half{symbol_mm * uniform(random, 1, 6), symbol_mm * uniform(random, 1, 4), uniform(random, 5, 40)};
    const Matrix3d axes = turned_and_tilted(random, 25);
    const Vector3d at = somewhere(random, wall - uniform(random, 0, high));
    scene.add_box(at, axes, half, any_albedo(random));
  }
  return scene;
}

/// Both faces of each step are seen, or from below the risers alone.
DepthScene lay_stairs(Random& random, double symbol_mm) {
  constexpr double kDegrees = 180 / std::numbers::pi;
  const bool from_below = whole(random, 0, 1) == 1;
  const double riser = symbol_mm * uniform(random, 1.5, from_below ? 10 : 7),
               tread = from_below ? riser * uniform(random, 0.3, 0.7) : symbol_mm * uniform(random, 1.5, 7);
  const double tilt = from_below ? uniform(random, -15, -2)  // the risers face the camera at 0, the treads at 90
                                 : std::atan2(tread, riser) * kDegrees + uniform(random, -35, 35);
  const double roll = either_sign(random, uniform(random, 5, 60)), slant = uniform(random, -15, 15);
  const Matrix3d axes = turned(roll, tilt, slant);
  const Vector3d middle(0, 0, uniform(random, 1900, 2050));
  DepthScene scene;
  const int steps = static_cast<int>(1.5 * kReachMm / std::hypot(tread, riser)) + 2;
  for (int i = -steps; i <= steps; ++i) {
    // Down and towards the camera from step to step.
    const Vector3d edge(0, i * riser, -i * tread);
    const auto add = [&](const Vector3d& centre, const Matrix3d& own, double half) {
      scene.begin_part(any_albedo(random));
      scene.add(Plate{middle + axes * centre, axes * own, {kLongMm, half}});
    };
    add(edge + Vector3d(0, riser / 2, 0), Matrix3d::Identity(), riser / 2);
    add(edge + Vector3d(0, 0, tread / 2), turned(0, 90, 0), tread / 2);
  }
  return scene;
}

constexpr SceneKind kSceneKinds[] = {
    {"oblique slats", false, lay_slats},
    {"oblique pickets", false, lay_pickets},
    {"leaves", false, lay_leaves},
    {"cables", false, lay_cables},
    {"small steps", false, lay_small_steps},
    {"perforated plate", true, lay_perforated_plate},
    {"balls", true, lay_balls},
    {"piles", true, lay_pile},
    {"stairs", true, lay_stairs},
};

}  // namespace

std::span<const SceneKind> scene_kinds() {
  return kSceneKinds;
}

}  // namespace slsd::adversary
