// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/adversary/scenes/depth_scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

namespace slsd::adversary {
namespace {

constexpr double kReferenceMm = 1900;  // where a surface that faces the projector has its full light
constexpr double kOwnSurface = 1e-4;   // of the way: an obstacle this near to the point is the point's own surface

/// point = origin + distance * direction
struct Ray {
  Eigen::Vector3d origin, direction;
};
struct Hit {
  double distance;
  Eigen::Vector3d normal;
};

bool is_in_hole(const Plate& plate, double along, double across) {
  const double row_pitch = plate.hole_pitch_mm * std::sqrt(0.75), row = std::round(across / row_pitch);
  const double shift = std::fmod(std::abs(row), 2) < 0.5 ? 0 : 0.5;
  const double column = std::round(along / plate.hole_pitch_mm - shift) + shift;
  const double x = along - column * plate.hole_pitch_mm, y = across - row * row_pitch;
  return x * x + y * y < plate.hole_radius_mm * plate.hole_radius_mm;
}

std::optional<Hit> meet(const Plate& plate, const Ray& ray) {
  const auto normal = plate.axes.col(2);
  const Eigen::Vector3d to_centre = plate.centre - ray.origin;
  const double slope = normal.dot(ray.direction), distance = normal.dot(to_centre) / slope;
  if (!(distance > 0 && std::isfinite(distance))) return std::nullopt;
  const Eigen::Vector3d at = distance * ray.direction - to_centre;
  const double along = plate.axes.col(0).dot(at), across = plate.axes.col(1).dot(at);
  if (std::abs(along) > plate.half_mm.x() || std::abs(across) > plate.half_mm.y()) return std::nullopt;
  if (plate.outline == Outline::kEllipse) {
    const double x = along / plate.half_mm.x(), y = across / plate.half_mm.y();
    if (x * x + y * y > 1) return std::nullopt;
  }
  if (plate.outline == Outline::kHoles && is_in_hole(plate, along, across)) return std::nullopt;
  return Hit{distance, slope > 0 ? Eigen::Vector3d(-normal) : Eigen::Vector3d(normal)};
}

/// The nearer root of a t^2 + 2 b t + c = 0, where the ray enters.
std::optional<double> entry(double a, double b, double c) {
  const double square = b * b - a * c;
  if (square < 0 || a <= 0) return std::nullopt;
  const double distance = (-b - std::sqrt(square)) / a;
  return distance > 0 ? std::optional(distance) : std::nullopt;
}

std::optional<Hit> meet(const Ball& ball, const Ray& ray) {
  const Eigen::Vector3d from_centre = ray.origin - ball.centre;
  const auto distance = entry(ray.direction.squaredNorm(), from_centre.dot(ray.direction),
                              from_centre.squaredNorm() - ball.radius_mm * ball.radius_mm);
  if (!distance) return std::nullopt;
  return Hit{*distance, (from_centre + *distance * ray.direction) / ball.radius_mm};
}

std::optional<Hit> meet(const Tube& tube, const Ray& ray) {
  const Eigen::Vector3d axis = (tube.to - tube.from).normalized(), from = ray.origin - tube.from;
  const Eigen::Vector3d across = ray.direction - axis.dot(ray.direction) * axis, beside = from - axis.dot(from) * axis;
  const auto distance =
      entry(across.squaredNorm(), beside.dot(across), beside.squaredNorm() - tube.radius_mm * tube.radius_mm);
  if (!distance) return std::nullopt;
  const double along = axis.dot(from + *distance * ray.direction);
  if (along < 0 || along > (tube.to - tube.from).norm()) return std::nullopt;
  return Hit{*distance, (beside + *distance * across) / tube.radius_mm};
}

using Corners = std::vector<Eigen::Vector3d>;

void add_cube(const Eigen::Vector3d& centre, double half, Corners& corners) {
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d sign((i & 1) == 0 ? -1 : 1, (i & 2) == 0 ? -1 : 1, (i & 4) == 0 ? -1 : 1);
    corners.push_back(centre + half * sign);
  }
}

/// Points whose hull holds the shape.
Corners hull_of(const Plate& plate) {
  Corners corners;
  for (const double x : {-1., 1.})
    for (const double y : {-1., 1.})
      corners.push_back(plate.centre + x * plate.half_mm.x() * plate.axes.col(0) +
                        y * plate.half_mm.y() * plate.axes.col(1));
  return corners;
}
Corners hull_of(const Ball& ball) {
  Corners corners;
  add_cube(ball.centre, ball.radius_mm, corners);
  return corners;
}
Corners hull_of(const Tube& tube) {
  Corners corners;
  add_cube(tube.from, tube.radius_mm, corners);
  add_cube(tube.to, tube.radius_mm, corners);
  return corners;
}

/// The shapes that each tile of a device's image can show.
class Tiles {
 public:
  Tiles(const DepthScene& scene, const Lens& lens, const RigidTransform& device_from_camera)
      : across_(lens.width_px / kTilePx + 1), down_(lens.height_px / kTilePx + 1), tiles_(across_ * down_) {
    for (const DepthScene::Solid& solid : scene.solids()) {
      Eigen::Array2d least(0, 0), most(across_ - 1, down_ - 1);
      bound(std::visit([](const auto& shape) { return hull_of(shape); }, solid.shape), lens, device_from_camera, least,
            most);
      for (int y = static_cast<int>(least.y()); y <= static_cast<int>(most.y()); ++y)
        for (int x = static_cast<int>(least.x()); x <= static_cast<int>(most.x()); ++x)
          tiles_[static_cast<std::size_t>(y) * across_ + x].push_back(&solid);
    }
  }

  [[nodiscard]] const std::vector<const DepthScene::Solid*>& at(double u, double v) const {
    return tiles_[static_cast<std::size_t>(v) / kTilePx * across_ + static_cast<std::size_t>(u) / kTilePx];
  }

 private:
  static constexpr int kTilePx = 32;

  /// Narrows the range of tiles; leaves it whole if a corner lies behind the device.
  static void bound(const Corners& corners, const Lens& lens, const RigidTransform& device_from_camera,
                    Eigen::Array2d& least, Eigen::Array2d& most) {
    constexpr double kFar = std::numeric_limits<double>::max();
    Eigen::Array2d low(kFar, kFar), high(-kFar, -kFar);
    for (const Eigen::Vector3d& corner : corners) {
      const Eigen::Vector3d point = device_from_camera * corner;
      if (point.z() < 1) return;
      const Eigen::Array2d tile = lens.project(point).array() / kTilePx;
      low = low.min(tile - 0.1), high = high.max(tile + 0.1);
    }
    least = least.max(low.floor()), most = most.min(high.floor());
  }

  int across_, down_;
  std::vector<std::vector<const DepthScene::Solid*>> tiles_;
};

class Look {
 public:
  Look(const DepthScene& scene, const Calibration& rig)
      : scene_(scene),
        lens_(rig.cameras[0].lens),
        projector_(rig.projector),
        projector_from_camera_(rig.cameras[0].projector_from_camera),
        projector_centre_(projector_from_camera_.inverse().translation),
        camera_tiles_(scene, lens_, {}),
        projector_tiles_(scene, projector_, projector_from_camera_) {}

  [[nodiscard]] SceneTruth at_all() const {
    const int width = lens_.width_px, height = lens_.height_px;
    SceneTruth truth{Image<float>(width, height), Image<std::uint16_t>(width, height, SceneTruth::kNothing),
                     Image<std::array<float, 2>>(width, height, {-1, -1}), Image<float>(width, height),
                     Image<float>(width, height)};
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) look(x, y, truth);
    return truth;
  }

 private:
  void look(int x, int y, SceneTruth& truth) const {
    const Eigen::Vector2d slope = lens_.undistort({x, y});
    const Ray ray{Eigen::Vector3d::Zero(), {slope.x(), slope.y(), 1}};
    std::optional<Hit> nearest;
    for (const DepthScene::Solid* const solid : camera_tiles_.at(x, y)) {
      const auto hit = std::visit([&](const auto& shape) { return meet(shape, ray); }, solid->shape);
      if (!hit || (nearest && nearest->distance <= hit->distance)) continue;
      nearest = hit, truth.part.at(x, y) = solid->part;
    }
    if (!nearest) return;
    truth.depth_mm.at(x, y) = static_cast<float>(nearest->distance);
    truth.albedo.at(x, y) = scene_.albedo(truth.part.at(x, y));
    light(nearest->distance * ray.direction, nearest->normal, x, y, truth);
  }

  void light(const Eigen::Vector3d& point, const Eigen::Vector3d& normal, int x, int y, SceneTruth& truth) const {
    const Eigen::Vector3d beam = point - projector_centre_;
    const double cosine = -normal.dot(beam) / beam.norm();
    if (cosine <= 0) return;
    const Eigen::Vector2d px = projector_.project(projector_from_camera_ * point);
    if (px.x() < 0 || px.y() < 0 || px.x() > projector_.width_px - 1 || px.y() > projector_.height_px - 1) return;
    const Ray ray{projector_centre_, beam};
    for (const DepthScene::Solid* const solid : projector_tiles_.at(px.x(), px.y())) {
      const auto hit = std::visit([&](const auto& shape) { return meet(shape, ray); }, solid->shape);
      if (hit && hit->distance < 1 - kOwnSurface) return;
    }
    truth.projector_px.at(x, y) = {static_cast<float>(px.x()), static_cast<float>(px.y())};
    truth.shade.at(x, y) =
        truth.albedo.at(x, y) * static_cast<float>(cosine * kReferenceMm * kReferenceMm / beam.squaredNorm());
  }

  const DepthScene& scene_;
  Lens lens_, projector_;
  RigidTransform projector_from_camera_;
  Eigen::Vector3d projector_centre_;
  Tiles camera_tiles_, projector_tiles_;
};

}  // namespace

void DepthScene::add_box(const Eigen::Vector3d& centre, const Eigen::Matrix3d& axes, const Eigen::Vector3d& half_mm,
                         double albedo) {
  const auto side = [&](int along, int across, int normal, double sign) {
    Eigen::Matrix3d turned;
    turned << axes.col(along), axes.col(across), axes.col(normal);
    begin_part(albedo);
    add(Plate{centre + sign * half_mm[normal] * axes.col(normal), turned, {half_mm[along], half_mm[across]}});
  };
  side(0, 1, 2, -1);
  for (const double sign : {-1., 1.}) side(1, 2, 0, sign), side(2, 0, 1, sign);
}

SceneTruth look_at(const DepthScene& scene, const Calibration& rig) {
  return Look(scene, rig).at_all();
}

}  // namespace slsd::adversary
