// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/board/grids/saddle.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <ceres/tiny_solver.h>
#include <Eigen/Geometry>

namespace slsd {
namespace {

constexpr int kMaxSteps = 30;
constexpr double kConverged = 1e-9;  // a step that reduces the sum of squares by less than this share
constexpr int kMaxCentres = 8;
constexpr double kStays_px = 0.05;
constexpr double kLeastBlur_px = 0.2;
constexpr double kMaxMisfit = 0.15;  // relative to the step; noise and markers cause less than 0.1
constexpr double kLeastStep = 3;     // levels
constexpr double kLeastAngle = 0.3;  // sine of the angle between the edges

enum Parameter { kX, kY, kAngleU, kAngleV, kBlur, kMean, kHalfStep, kSlopeX, kSlopeY, kParameters };
using Vector = Eigen::Matrix<double, kParameters, 1>;

struct Edge {
  double value;  // E(distance / blur)
  double slope;  // derivative with respect to the distance
};

Edge edge_at(double distance, double blur) {
  const double x = distance / blur;
  return {std::erf(x * std::numbers::sqrt2 / 2), std::sqrt(2 / std::numbers::pi) / blur * std::exp(-x * x / 2)};
}

struct Sample {
  Eigen::Vector2d at;
  double level;
  double weight;
};

std::vector<Sample> samples_around(const Image<float>& light, const Eigen::Vector2d& centre, double reach) {
  const auto first = [&](double c) { return static_cast<int>(std::ceil(c - reach)); };
  const auto last = [&](double c) { return static_cast<int>(std::floor(c + reach)); };
  std::vector<Sample> samples;
  if (!light.view().contains(first(centre.x()), first(centre.y()))) return samples;
  if (!light.view().contains(last(centre.x()), last(centre.y()))) return samples;
  for (int y = first(centre.y()); y <= last(centre.y()); ++y) {
    for (int x = first(centre.x()); x <= last(centre.x()); ++x) {
      const Eigen::Vector2d at(x, y);
      const double share = (at - centre).squaredNorm() / (reach * reach);
      if (share < 1) samples.push_back({at, light.at(x, y), (1 - share) * (1 - share)});
    }
  }
  return samples;
}

// The model's level at a sample, and its derivatives.
double model(const Vector& p, const Eigen::Vector2d& at, Vector& gradient) {
  const Eigen::Vector2d d = at - p.head<2>();
  const Eigen::Vector2d along_u(std::cos(p[kAngleU]), std::sin(p[kAngleU]));
  const Eigen::Vector2d along_v(std::cos(p[kAngleV]), std::sin(p[kAngleV]));
  const Eigen::Vector2d across_u(-along_u.y(), along_u.x());
  const Eigen::Vector2d across_v(-along_v.y(), along_v.x());
  const double u = across_u.dot(d);
  const double v = across_v.dot(d);
  const Edge edge_u = edge_at(u, p[kBlur]);
  const Edge edge_v = edge_at(v, p[kBlur]);
  const double albedo = p[kMean] + p[kHalfStep] * edge_u.value * edge_v.value;
  const double light = 1 + p[kSlopeX] * d.x() + p[kSlopeY] * d.y();
  const double by_u = p[kHalfStep] * light * edge_u.slope * edge_v.value;
  const double by_v = p[kHalfStep] * light * edge_v.slope * edge_u.value;
  gradient.head<2>() = -by_u * across_u - by_v * across_v - albedo * p.segment<2>(kSlopeX);
  gradient[kAngleU] = -by_u * along_u.dot(d);
  gradient[kAngleV] = -by_v * along_v.dot(d);
  gradient[kBlur] = -(by_u * u + by_v * v) / p[kBlur];
  gradient[kMean] = light;
  gradient[kHalfStep] = light * edge_u.value * edge_v.value;
  gradient.tail<2>() = albedo * d;
  return albedo * light;
}

/// Residuals of the model at each sample, times the root of its weight, in the form that Ceres' small solver expects.
struct Residuals {
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = kParameters };  // NOLINT: Ceres' names
  const std::vector<Sample>& samples;

  [[nodiscard]] int NumResiduals() const { return static_cast<int>(samples.size()); }  // NOLINT: Ceres' name
  bool operator()(const double* parameters, double* residuals, double* jacobian) const {
    Vector p(parameters), gradient;
    p[kBlur] = std::max(p[kBlur], kLeastBlur_px);  // a sharper image looks the same
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const double root = std::sqrt(samples[i].weight);
      residuals[i] = root * (model(p, samples[i].at, gradient) - samples[i].level);
      if (jacobian == nullptr) continue;
      for (int k = 0; k < kParameters; ++k)
        jacobian[static_cast<std::size_t>(k) * samples.size() + i] = root * gradient[k];
    }
    return true;
  }
};

Vector first_estimate(const std::vector<Sample>& samples, const SaddleGuess& guess) {
  double sum = 0;
  double weight = 0;
  for (const Sample& sample : samples) {
    sum += sample.weight * sample.level;
    weight += sample.weight;
  }
  Vector p;
  p << guess.pixel.x(), guess.pixel.y(), std::atan2(guess.right.y(), guess.right.x()),
      std::atan2(guess.down.y(), guess.down.x()), 1, sum / weight, 0, 0, 0;
  double product = 0;
  double norm = 0;
  Vector gradient;
  for (const Sample& sample : samples) {
    model(p, sample.at, gradient);
    product += sample.weight * gradient[kHalfStep] * (sample.level - p[kMean]);
    norm += sample.weight * gradient[kHalfStep] * gradient[kHalfStep];
  }
  p[kHalfStep] = product / std::max(norm, 1e-9);
  return p;
}

bool plausible(const Vector& p, const SaddleGuess& guess, double reach) {
  return (p.head<2>() - guess.pixel).norm() < reach && p[kBlur] < reach &&
         std::abs(std::sin(p[kAngleV] - p[kAngleU])) > kLeastAngle;
}

}  // namespace

double SaddleGuess::square_px() const {
  const double area = std::abs(right.x() * down.y() - right.y() * down.x());
  return area / std::max({right.norm(), down.norm(), 1e-9});
}

std::optional<Saddle> fit_saddle(const Image<float>& light, const SaddleGuess& guess, double reach_px) {
  auto samples = samples_around(light, guess.pixel, reach_px);
  if (samples.empty()) return std::nullopt;
  Vector p = first_estimate(samples, guess);
  ceres::TinySolver<Residuals> solver;
  solver.options.max_num_iterations = kMaxSteps, solver.options.function_tolerance = kConverged;
  // Weights are centred on the corner, so that they do not pull it to the guess.
  Eigen::Vector2d centre = guess.pixel;
  for (int nth = 0;; ++nth) {
    solver.Solve(Residuals{samples}, &p);
    if (!p.allFinite() || !plausible(p, guess, reach_px) || nth == kMaxCentres) return std::nullopt;
    if ((p.head<2>() - centre).norm() < kStays_px) break;
    centre = p.head<2>();
    samples = samples_around(light, centre, reach_px);
    if (samples.empty()) return std::nullopt;
  }
  double weight = 0;
  for (const Sample& sample : samples) weight += sample.weight;
  const double step = 2 * p[kHalfStep];
  const double misfit = std::sqrt(2 * solver.summary.final_cost / weight) / std::max(std::abs(step), 1e-9);
  if (std::abs(step) < kLeastStep || misfit > kMaxMisfit) return std::nullopt;
  return Saddle{p.head<2>(), step, std::max(p[kBlur], kLeastBlur_px), misfit};
}

}  // namespace slsd
