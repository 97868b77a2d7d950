// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "picture/cloud/relief.hpp"

#include <algorithm>
#include <cmath>

#include "picture/canvas.hpp"
#include "picture/depth_colour.hpp"

namespace slsd {
namespace {

constexpr float kEmpty = std::numeric_limits<float>::infinity();
constexpr double kAmbient = 0.42;
constexpr double kDiffuse = 0.66;
constexpr double kGloss = 0.16;
constexpr int kGlossExponent = 24;
constexpr double kOutline = 0.45;

Rgb lit(Rgb colour, const Eigen::Vector3d& normal, const Eigen::Vector3d& forward) {
  const Eigen::Vector3d facing = normal.dot(forward) > 0 ? Eigen::Vector3d(-normal) : normal;
  const Eigen::Vector3d light = light_direction();
  const double diffuse = kAmbient + kDiffuse * std::max(0.0, facing.dot(light));
  const double gloss = kGloss * std::pow(std::max(0.0, facing.dot((light - forward).normalized())), kGlossExponent);
  Rgb result;
  for (std::size_t i = 0; i < 3; ++i) {
    result[i] = static_cast<std::uint8_t>(std::clamp(std::lround(colour[i] * diffuse + 255 * gloss), 0L, 255L));
  }
  return result;
}

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

// The samples of a pixel are symmetric about its centre.
Eigen::Vector3d to_samples(const Eigen::Vector3d& place) {
  const double shift = 0.5 * (Relief::kSamples - 1);
  return {place.x() * Relief::kSamples + shift, place.y() * Relief::kSamples + shift, place.z()};
}

}  // namespace

Eigen::Vector3d light_direction() {
  return Eigen::Vector3d(-0.30, -0.62, -0.72).normalized();
}

Relief::Relief(int width_px, int height_px, const Eigen::Vector3d& forward)
    : forward_(forward),
      depth_(width_px * kSamples, height_px * kSamples, kEmpty),
      colour_(width_px * kSamples, height_px * kSamples) {}

void Relief::sample(int x, int y, double depth, const Eigen::Vector3d& normal, Rgb colour) {
  if (!(depth < depth_.at(x, y))) return;
  depth_.at(x, y) = static_cast<float>(depth);
  colour_.at(x, y) = lit(colour, normal.normalized(), forward_);
}

void Relief::triangle(const std::array<ReliefVertex, 3>& corners) {
  std::array<Eigen::Vector3d, 3> at;
  std::transform(corners.begin(), corners.end(), at.begin(), [](const auto& one) { return to_samples(one.place); });
  const Eigen::Vector2d a = at[0].head<2>(), b = at[1].head<2>(), c = at[2].head<2>();
  const double area = cross(b - a, c - a);
  if (!(std::abs(area) > 1e-9)) return;
  const auto [left, right] = std::minmax({a.x(), b.x(), c.x()});
  const auto [top, bottom] = std::minmax({a.y(), b.y(), c.y()});
  const int last_x = static_cast<int>(std::min(std::floor(right), depth_.width() - 1.0));
  const int last_y = static_cast<int>(std::min(std::floor(bottom), depth_.height() - 1.0));
  for (int y = static_cast<int>(std::max(0.0, std::ceil(top))); y <= last_y; ++y) {
    for (int x = static_cast<int>(std::max(0.0, std::ceil(left))); x <= last_x; ++x) {
      const Eigen::Vector2d p(x, y);
      const double wb = cross(p - a, c - a) / area, wc = cross(b - a, p - a) / area, wa = 1 - wb - wc;
      if (wa < -1e-9 || wb < -1e-9 || wc < -1e-9) continue;
      sample(x, y, wa * at[0].z() + wb * at[1].z() + wc * at[2].z(),
             wa * corners[0].normal + wb * corners[1].normal + wc * corners[2].normal,
             depth_colour(wa * corners[0].colour_share + wb * corners[1].colour_share + wc * corners[2].colour_share));
    }
  }
}

void Relief::disc(const ReliefVertex& centre, double radius_px) {
  const Eigen::Vector3d at = to_samples(centre.place);
  const Rgb colour = mix(Rgb{0, 0, 0}, depth_colour(centre.colour_share), centre.brightness);
  const double radius = radius_px * kSamples;
  const int last_x = static_cast<int>(std::min(std::floor(at.x() + radius), depth_.width() - 1.0));
  const int last_y = static_cast<int>(std::min(std::floor(at.y() + radius), depth_.height() - 1.0));
  for (int y = static_cast<int>(std::max(0.0, std::ceil(at.y() - radius))); y <= last_y; ++y) {
    for (int x = static_cast<int>(std::max(0.0, std::ceil(at.x() - radius))); x <= last_x; ++x) {
      if ((Eigen::Vector2d(x, y) - at.head<2>()).norm() <= radius) {
        sample(x, y, at.z(), centre.normal, colour);
      }
    }
  }
}

bool Relief::outlined(int x, int y, float jump) const {
  const float depth = depth_.at(x, y);
  const auto behind = [&](int nx, int ny) {
    return nx >= 0 && ny >= 0 && nx < depth_.width() && ny < depth_.height() && depth_.at(nx, ny) > depth + jump;
  };
  return behind(x - 1, y) || behind(x + 1, y) || behind(x, y - 1) || behind(x, y + 1);
}

void Relief::compose(ColourImage& picture, double jump) const {
  constexpr int kCount = kSamples * kSamples;
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      std::array<int, 3> sum{};
      int covered = 0, dark = 0;
      for (int i = 0; i < kCount; ++i) {
        const int sx = x * kSamples + i % kSamples, sy = y * kSamples + i / kSamples;
        if (depth_.at(sx, sy) == kEmpty) continue;
        ++covered;
        dark += outlined(sx, sy, static_cast<float>(jump)) ? 1 : 0;
        for (std::size_t c = 0; c < 3; ++c) sum[c] += colour_.at(sx, sy)[c];
      }
      if (covered == 0) continue;
      const Rgb mean{static_cast<std::uint8_t>(sum[0] / covered), static_cast<std::uint8_t>(sum[1] / covered),
                     static_cast<std::uint8_t>(sum[2] / covered)};
      const Rgb edged = mix(mean, Rgb{20, 24, 40}, kOutline * dark / covered);
      picture.at(x, y) = mix(picture.at(x, y), edged, static_cast<double>(covered) / kCount);
    }
  }
}

}  // namespace slsd
