// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/simulator/simulator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

namespace slsd {
namespace {

using Point = Eigen::Vector2f;
constexpr int kSamplesPerSide = 3;
constexpr float kDark = -1e6F;

// A point that one device sees is lit or seen by the other if nothing is met before it.
bool visible(const Surface& surface, const Eigen::Vector3d& from, const Eigen::Vector3d& point) {
  const auto first = surface({from, point - from});
  return first && *first > 1 - 1e-6;
}

// The projector pixel under each corner of a camera pixel: (x, y) is the top left corner of pixel (x, y).
Image<Point> corners(const Calibration& calibration, const Surface& surface, std::size_t camera_index) {
  const Lens& lens = calibration.cameras[camera_index].lens;
  Image<Point> map(lens.width_px + 1, lens.height_px + 1, Point(kDark, kDark));
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < map.width(); ++x) {
      const auto pixel = projector_from_camera({x - 0.5, y - 0.5}, calibration, surface, camera_index);
      if (pixel) map.at(x, y) = pixel->cast<float>();
    }
  }
  return map;
}

// An interval no longer than a pixel covers one pixel of the projector, or two.
struct Cover {
  int first;
  float share_of_second;
};

Cover cover(float middle, float width) {
  const float low = middle - width / 2 + 0.5F;
  const float first = std::floor(low);
  return {static_cast<int>(first), std::max(0.F, low + width - (first + 1)) / width};
}

float light_at(const Grey8& pattern, int x, int y) {
  return pattern.view().contains(x, y) ? static_cast<float>(pattern.at(x, y)) / 255.F : 0.F;
}

float mix(float a, float b, float share_of_b) {
  return a + (b - a) * share_of_b;
}

// The mean of the pattern over a box. Points alone would move a symbol's edge by an eighth of a pixel.
float light_on_box(const Grey8& pattern, const Point& middle, const Point& extent) {
  const Cover x = cover(middle.x(), extent.x());
  const Cover y = cover(middle.y(), extent.y());
  const auto row = [&](int v) {
    return mix(light_at(pattern, x.first, v), light_at(pattern, x.first + 1, v), x.share_of_second);
  };
  return mix(row(y.first), row(y.first + 1), y.share_of_second);
}

// The mean of the pattern over a camera pixel, whose four corners fall on these projector pixels.
float light_on_pixel(const Grey8& pattern, const std::array<Point, 4>& corner) {
  const Point right = (corner[1] - corner[0]) / kSamplesPerSide;
  const Point down = (corner[2] - corner[0]) / kSamplesPerSide;
  const Point extent = (right.cwiseAbs() + down.cwiseAbs()).cwiseMax(1e-3F).cwiseMin(1.F);
  float sum = 0;
  for (int j = 0; j < kSamplesPerSide; ++j) {
    for (int i = 0; i < kSamplesPerSide; ++i) {
      const Point middle = corner[0] + (static_cast<float>(i) + 0.5F) * right + (static_cast<float>(j) + 0.5F) * down;
      sum += light_on_box(pattern, middle, extent);
    }
  }
  return sum / (kSamplesPerSide * kSamplesPerSide);
}

cv::Mat1f irradiance(const Grey8& pattern, const Image<Point>& map) {
  cv::Mat1f image(map.height() - 1, map.width() - 1, 0.F);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const std::array<Point, 4> corner{map.at(x, y), map.at(x + 1, y), map.at(x, y + 1), map.at(x + 1, y + 1)};
      const bool lit = std::all_of(corner.begin(), corner.end(), [](const Point& p) { return p.x() > kDark; });
      if (lit) image(y, x) = light_on_pixel(pattern, corner);
    }
  }
  return image;
}

// Grey values: the light that falls off linearly to the right, and the sensor's noise.
Grey8 develop(const cv::Mat1f& light, const SimulationOptions& options) {
  std::mt19937 random(options.seed);
  std::normal_distribution<double> noise(0, options.noise_sigma);
  Grey8 frame(light.cols, light.rows);
  for (int y = 0; y < frame.height(); ++y) {
    for (int x = 0; x < frame.width(); ++x) {
      const double fade = 1 - (1 - 1 / options.falloff) * x / std::max(1, frame.width() - 1);
      const double grey = fade * (options.dark + (options.lit - options.dark) * light(y, x));
      frame.at(x, y) = static_cast<std::uint8_t>(std::lround(std::clamp(grey + noise(random), 0., 255.)));
    }
  }
  return frame;
}

Eigen::Vector3d ray_of(const Lens& lens, const Eigen::Vector2d& pixel) {
  return lens.undistort(pixel).homogeneous();
}

}  // namespace

Calibration paper_rig() {
  const Eigen::Vector3d centre(180, 0, 40);
  const Eigen::Vector3d forward = (Eigen::Vector3d(0, 0, 2000) - centre).normalized();
  const Eigen::Vector3d right = Eigen::Vector3d::UnitY().cross(forward).normalized();
  RigidTransform projector_from_camera;
  projector_from_camera.rotation << right.transpose(), forward.cross(right).transpose(), forward.transpose();
  projector_from_camera.translation = -projector_from_camera.rotation * centre;
  Calibration rig;
  rig.projector = {1280, 800, 1280 * 1.96, 1280 * 1.96, 639.5, 399.5, {}};
  rig.cameras = {{"camera", {1600, 1200, 1600 / 0.45, 1600 / 0.45, 799.5, 599.5, {}}, projector_from_camera, {}}};
  return rig;
}

Grey8 simulate(const Grey8& pattern, const Calibration& calibration, const Surface& surface,
               const SimulationOptions& options, std::size_t camera_index) {
  cv::Mat1f light = irradiance(pattern, corners(calibration, surface, camera_index));
  if (options.blur_sigma_px > 0) cv::GaussianBlur(light, light, {}, options.blur_sigma_px);
  return develop(light, options);
}

std::optional<Eigen::Vector2d> camera_from_projector(const Eigen::Vector2d& projector_px,
                                                     const Calibration& calibration, const Surface& surface,
                                                     std::size_t camera_index) {
  const CalibratedCamera& camera = calibration.cameras[camera_index];
  const RigidTransform camera_from_projector = camera.projector_from_camera.inverse();
  const Ray ray{camera_from_projector.translation,
                camera_from_projector.rotation * ray_of(calibration.projector, projector_px)};
  const auto t = surface(ray);
  if (!t) return std::nullopt;
  const Eigen::Vector3d point = ray.origin + *t * ray.direction;
  if (point.z() <= 0 || !visible(surface, Eigen::Vector3d::Zero(), point)) return std::nullopt;
  return camera.lens.project(point);
}

std::optional<Eigen::Vector2d> projector_from_camera(const Eigen::Vector2d& camera_px, const Calibration& calibration,
                                                     const Surface& surface, std::size_t camera_index) {
  const CalibratedCamera& camera = calibration.cameras[camera_index];
  const Ray ray{Eigen::Vector3d::Zero(), ray_of(camera.lens, camera_px)};
  const auto t = surface(ray);
  if (!t) return std::nullopt;
  const Eigen::Vector3d point = *t * ray.direction;
  const RigidTransform& motion = camera.projector_from_camera;
  const Eigen::Vector3d point_in_projector = motion * point;
  if (point_in_projector.z() <= 0 || !visible(surface, motion.inverse().translation, point)) return std::nullopt;
  return calibration.projector.project(point_in_projector);
}

}  // namespace slsd
