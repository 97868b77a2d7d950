// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/board/markers/marker_edges.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace slsd {
namespace {

constexpr double kEndsLeftOut = 0.12;  // share of the side that is ignored at either end, as the corner bends the edge
                                       // there
constexpr double kStepPx = 0.5;
constexpr double kLeastStep = 3;  // levels
constexpr int kRounds = 3;
constexpr int kLeastPoints = 4;
constexpr double kOwnVariancePx2 = 1.0 / 6;  // blur that interpolation between pixels adds
constexpr double kOutlierPx = 0.7;

struct EdgePoint {
  Eigen::Vector2d at;
  double step = 0;
  double variance_px2 = 0;
};

struct EdgeLine {
  Eigen::Vector2d through;
  Eigen::Vector2d along;
  double step = 0;
  double blur_px = 0;
};

std::optional<double> level_at(const Image<float>& light, const Eigen::Vector2d& at) {
  const int x = static_cast<int>(std::floor(at.x()));
  const int y = static_cast<int>(std::floor(at.y()));
  if (!light.view().contains(x, y) || !light.view().contains(x + 1, y + 1)) return std::nullopt;
  return level_between(light.view(), x, y, at.x() - x, at.y() - y);
}

// Centroid of the slope from black to white along a line through `at`.
std::optional<EdgePoint> edge_near(const Image<float>& light, const Eigen::Vector2d& at,
                                   const Eigen::Vector2d& outwards, double reach) {
  double sum = 0;
  double moment = 0;
  double square = 0;
  const int steps = static_cast<int>(2 * reach / kStepPx);
  auto before = level_at(light, at - reach * outwards);
  for (int i = 0; i < steps; ++i) {
    const double place = -reach + (i + 0.5) * kStepPx;
    const auto after = level_at(light, at + (place + 0.5 * kStepPx) * outwards);
    if (!before || !after) return std::nullopt;
    const double slope = *after - *before;
    sum += slope;
    moment += slope * place;
    square += slope * place * place;
    before = after;
  }
  if (sum < kLeastStep || std::abs(moment / sum) > reach) return std::nullopt;
  const double centre = moment / sum;
  return EdgePoint{at + centre * outwards, sum, std::max(0.0, square / sum - centre * centre)};
}

std::vector<EdgePoint> edge_points(const Image<float>& light, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                                   double reach) {
  const Eigen::Vector2d along = (to - from).normalized();
  const Eigen::Vector2d outwards(along.y(), -along.x());
  const double length = (to - from).norm();
  std::vector<EdgePoint> points;
  for (double t = kEndsLeftOut * length; t <= (1 - kEndsLeftOut) * length; t += kStepPx) {
    auto point = edge_near(light, from + t * along, outwards, reach);
    for (int i = 0; i < kRounds && point; ++i) point = edge_near(light, point->at, outwards, reach);
    if (point) points.push_back(*point);
  }
  return points;
}

EdgeLine line_through(const std::vector<EdgePoint>& points) {
  EdgeLine line{Eigen::Vector2d::Zero(), {}, 0, 0};
  const auto count = static_cast<double>(points.size());
  double variance = 0;
  for (const auto& point : points) {
    line.through += point.at / count;
    line.step += point.step / count;
    variance += point.variance_px2 / count;
  }
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const auto& point : points) spread += (point.at - line.through) * (point.at - line.through).transpose();
  line.along = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(spread).eigenvectors().col(1);
  line.blur_px = std::sqrt(std::max(0.0, variance - kOwnVariancePx2));
  return line;
}

std::optional<EdgeLine> fit_edge(const Image<float>& light, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                                 double reach) {
  auto points = edge_points(light, from, to, reach);
  for (int round = 0; round < 2; ++round) {
    if (points.size() < kLeastPoints) return std::nullopt;
    const EdgeLine line = line_through(points);
    std::erase_if(points, [&](const EdgePoint& point) {
      const Eigen::Vector2d off = point.at - line.through;
      return std::abs(off.x() * line.along.y() - off.y() * line.along.x()) > kOutlierPx;
    });
  }
  if (points.size() < kLeastPoints) return std::nullopt;
  return line_through(points);
}

std::optional<Eigen::Vector2d> meet(const EdgeLine& a, const EdgeLine& b) {
  Eigen::Matrix2d sides;
  sides << a.along, -b.along;
  if (std::abs(sides.determinant()) < 0.2) return std::nullopt;
  return a.through + a.along * sides.inverse().row(0).dot(b.through - a.through);
}

}  // namespace

std::optional<std::array<MeasuredPoint, 4>> measure_square(const Image<float>& light, const Quad& quad,
                                                           double reach_px) {
  std::array<std::optional<EdgeLine>, 4> edges;
  for (std::size_t i = 0; i < 4; ++i) edges[i] = fit_edge(light, quad[i], quad[(i + 1) % 4], reach_px);
  std::array<MeasuredPoint, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& before = edges[(i + 3) % 4];
    const auto& after = edges[i];
    if (!before || !after) return std::nullopt;
    const auto corner = meet(*before, *after);
    if (!corner || (*corner - quad[i]).norm() > 4 + reach_px) return std::nullopt;
    corners[i] = {
        {static_cast<int>(i), *corner}, (before->step + after->step) / 2, (before->blur_px + after->blur_px) / 2};
  }
  return corners;
}

}  // namespace slsd
