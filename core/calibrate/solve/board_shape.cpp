// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/solve/board_shape.hpp"

#include <cmath>
#include <utility>

namespace slsd {
namespace {

constexpr std::size_t kOrders = 5;
/// Reach from the centre, in halves of the longer side: beyond it, a polynomial soon is higher than any board.
constexpr double kReach = 2;

/// Powers of u and v in each term.
struct Powers {
  std::size_t u, v;
};
constexpr std::array<Powers, kShapeTerms> kPowers{
    {{2, 0}, {1, 1}, {0, 2}, {3, 0}, {2, 1}, {1, 2}, {0, 3}, {4, 0}, {3, 1}, {2, 2}, {1, 3}, {0, 4}}};

std::array<double, kOrders> powers_of(double base) {
  std::array<double, kOrders> powers{1};
  for (std::size_t i = 1; i < kOrders; ++i) powers[i] = powers[i - 1] * base;
  return powers;
}

/// Adds a term. Its powers are constants of the program: looking them up would double the time.
template <std::size_t kTerm>
void add_term(double by_mm, const std::array<double, kOrders>& u, const std::array<double, kOrders>& v,
              ShapeAt& shape) {
  constexpr Powers kPower = kPowers[kTerm];
  const double term = u[kPower.u] * v[kPower.v];
  shape.by_term(static_cast<Eigen::Index>(kTerm)) = term;
  shape.height_mm += by_mm * term;
  if constexpr (kPower.u > 0) shape.slope.x() += by_mm * static_cast<double>(kPower.u) * u[kPower.u - 1] * v[kPower.v];
  if constexpr (kPower.v > 0) shape.slope.y() += by_mm * static_cast<double>(kPower.v) * u[kPower.u] * v[kPower.v - 1];
}

template <std::size_t... kTerms>
void add_terms(const double* terms_mm, const std::array<double, kOrders>& u, const std::array<double, kOrders>& v,
               ShapeAt& shape, std::index_sequence<kTerms...> /*all*/) {
  (add_term<kTerms>(terms_mm[kTerms], u, v, shape), ...);
}

}  // namespace

ShapeAt shape_at(const double* terms_mm, const ShapeFrame& frame, const Eigen::Vector2d& board_mm) {
  const Eigen::Vector2d at = (board_mm - frame.middle_mm) / frame.half_mm;
  const Eigen::Vector2d within = at.cwiseMax(-kReach).cwiseMin(kReach);
  const auto u = powers_of(within.x()), v = powers_of(within.y());
  ShapeAt shape;
  add_terms(terms_mm, u, v, shape, std::make_index_sequence<kShapeTerms>());
  shape.slope = (within.array() == at.array()).select(shape.slope / frame.half_mm, 0);
  return shape;
}

std::optional<Eigen::Vector3d> meet_shape(const double* terms_mm, const ShapeFrame& frame, const Eigen::Vector3d& eye,
                                          const Eigen::Vector3d& ray) {
  constexpr int kRounds = 12;  // a board is nearly flat: three or four rounds are enough
  constexpr double kSettled = 1e-13;
  constexpr double kGrazing = 1e-9;  // rad: at a smaller angle, rounding decides where the ray meets the shape
  double along = -eye.z() / ray.z();
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::Vector3d at = eye + along * ray;
    const ShapeAt shape = shape_at(terms_mm, frame, at.head<2>());
    const double towards = ray.z() - shape.slope.dot(ray.head<2>());
    if (!(std::abs(towards) > kGrazing * ray.norm())) return std::nullopt;
    const double step = (shape.height_mm - at.z()) / towards;
    along += step;
    if (std::abs(step) <= kSettled * std::abs(along)) return eye + along * ray;
  }
  return std::nullopt;
}

ShapeVector plausible_shape(const ShapeFrame& frame) {
  constexpr double kSecondOrder = 0.01, kHigherOrders = 0.001;  // shares of half the longer side
  ShapeVector sigmas_mm;
  for (std::size_t i = 0; i < kShapeTerms; ++i) {
    sigmas_mm[i] = (i < kSecondOrderTerms ? kSecondOrder : kHigherOrders) * frame.half_mm;
  }
  return sigmas_mm;
}

}  // namespace slsd
