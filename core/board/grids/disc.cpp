// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/board/grids/disc.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>

#include "core/geometry/robust.hpp"

namespace slsd {
namespace {

constexpr double kLeastStepOfDisc = 3;  // levels
constexpr int kRays = 24;
constexpr double kOwnVariancePx2 = 0.25;  // blur that interpolation between pixels adds

struct Pixel {
  Eigen::Vector2d at;
  double level;
  double distance;  ///< distance from the centre on the board, as a share of the radius
};

std::vector<Pixel> pixels_about(const Image<float>& light, const Homography& local, const Eigen::Vector2d& centre_mm,
                                double radius_mm, double reach_mm) {
  const Eigen::Vector2d centre = local.map(centre_mm);
  const Eigen::Matrix2d step = local.jacobian(centre_mm);
  const Eigen::Matrix2d back = step.inverse();
  const Eigen::Vector2d half = step.rowwise().norm() * reach_mm;
  const Eigen::Vector2i first = (centre - half).array().ceil().cast<int>();
  const Eigen::Vector2i last = (centre + half).array().floor().cast<int>();
  std::vector<Pixel> pixels;
  if (!light.view().contains(first.x(), first.y()) || !light.view().contains(last.x(), last.y())) return pixels;
  for (int y = first.y(); y <= last.y(); ++y) {
    for (int x = first.x(); x <= last.x(); ++x) {
      const Eigen::Vector2d at(x, y);
      const double distance_mm = (back * (at - centre)).norm();
      if (distance_mm < reach_mm) pixels.push_back({at, light.at(x, y), distance_mm / radius_mm});
    }
  }
  return pixels;
}

// White level as a linear function, coefficients of (1, x, y).
Eigen::Vector3d fit_white(const std::vector<Pixel>& pixels, double from) {
  Eigen::Matrix3d left = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  const Eigen::Vector2d origin = pixels.front().at;
  for (const Pixel& pixel : pixels) {
    if (pixel.distance < from) continue;
    const Eigen::Vector3d row(1, pixel.at.x() - origin.x(), pixel.at.y() - origin.y());
    left += row * row.transpose();
    right += pixel.level * row;
  }
  Eigen::Vector3d plane = left.colPivHouseholderQr().solve(right);
  plane[0] -= plane[1] * origin.x() + plane[2] * origin.y();
  return plane;
}

// Ratio of black to white, which is constant over the disc even in uneven light.
double black_share(const std::vector<Pixel>& pixels, const Eigen::Vector3d& white) {
  double sum = 0;
  int count = 0;
  for (const Pixel& pixel : pixels) {
    if (pixel.distance > 0.6) continue;
    sum += pixel.level / white.dot(Eigen::Vector3d(1, pixel.at.x(), pixel.at.y()));
    ++count;
  }
  return count == 0 ? 1 : sum / count;
}

double level_at(const Image<float>& light, const Eigen::Vector2d& at) {
  const int x = std::clamp(static_cast<int>(at.x()), 0, light.width() - 2);
  const int y = std::clamp(static_cast<int>(at.y()), 0, light.height() - 2);
  return level_between(light.view(), x, y, at.x() - x, at.y() - y);
}

// From the steepest slope along each ray: a step of height 1 blurred by s has slope 1 / (s sqrt(2 pi)).
double blur_at_edge(const Image<float>& light, const Homography& local, const Eigen::Vector2d& centre_mm,
                    double radius_mm, double step) {
  const Eigen::Vector2d centre = local.map(centre_mm);
  std::vector<double> blurs;
  for (int ray = 0; ray < kRays; ++ray) {
    const double angle = ray * 2 * std::numbers::pi / kRays;
    const Eigen::Vector2d edge = local.map(centre_mm + radius_mm * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    const Eigen::Vector2d outwards = (edge - centre).normalized();
    const double reach = std::min(4.0, 0.5 * (edge - centre).norm());
    double steepest = 1e-9;
    for (double r = -reach; r <= reach; r += 0.5) {
      const Eigen::Vector2d at = edge + r * outwards;
      steepest = std::max(steepest, level_at(light, at + 0.5 * outwards) - level_at(light, at - 0.5 * outwards));
    }
    blurs.push_back(step / steepest / std::sqrt(2 * std::numbers::pi));
  }
  const double blur = median_in_place(blurs);
  return std::sqrt(std::max(0.0, blur * blur - kOwnVariancePx2));
}

}  // namespace

std::optional<Disc> measure_disc(const Image<float>& light, const Homography& local, const Eigen::Vector2d& centre_mm,
                                 double radius_mm, double clear_mm) {
  const auto pixels = pixels_about(light, local, centre_mm, radius_mm, clear_mm);
  if (pixels.empty()) return std::nullopt;
  const double white_from = (1 + 2 * clear_mm / radius_mm) / 3;
  const Eigen::Vector3d white = fit_white(pixels, white_from);
  const double black = black_share(pixels, white);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double weight = 0;
  for (const Pixel& pixel : pixels) {
    const double darkness = 1 - pixel.level / white.dot(Eigen::Vector3d(1, pixel.at.x(), pixel.at.y()));
    sum += darkness * pixel.at;
    weight += darkness;
  }
  const Eigen::Vector2d centroid = sum / weight;
  const double step = (1 - black) * white.dot(Eigen::Vector3d(1, centroid.x(), centroid.y()));
  const bool inside = (centroid - local.map(centre_mm)).norm() < local.jacobian(centre_mm).norm() * radius_mm;
  if (!(step > kLeastStepOfDisc) || !inside) return std::nullopt;
  return Disc{centroid, step, blur_at_edge(light, local, centre_mm, radius_mm, step)};
}

Eigen::Vector2d perspective_bias(const Homography& local, const Eigen::Vector2d& centre_mm, double radius_mm) {
  Eigen::Matrix3d onto_centre = Eigen::Matrix3d::Identity();
  onto_centre.topRightCorner<2, 1>() = centre_mm;
  const Eigen::Matrix3d map = local.matrix * onto_centre;
  // The centre is the pole of the line at infinity; the dual of the disc's conic needs no inverse of the map.
  const Eigen::Vector3d dual(radius_mm * radius_mm, radius_mm * radius_mm, -1);
  const Eigen::Vector3d pole = (map * dual.asDiagonal() * map.transpose()).col(2);
  return pole.hnormalized() - local.map(centre_mm);
}

}  // namespace slsd
