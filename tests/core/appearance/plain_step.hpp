// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <vector>

#include <Eigen/Cholesky>

#include "core/appearance/align_patches.hpp"

namespace slsd::test {

/// A step of align_cells() by the plainest means: pixel by pixel, in double precision, with a general solver.
struct PlainStep {
  PatchState state;
  double residual = 0, pixels = 0, support = 0, scatter = 0;
  /// Of disparity, its slopes, across; gain, its slopes, offset; the place's part for a noise of one grey level.
  Eigen::Matrix<double, kFitted, kFitted> covariance = Eigen::Matrix<double, kFitted, kFitted>::Zero();
  bool solved = false;
};

template <class T>
PlainStep plain_step(const ImageView<T>& frame, double full, const PatternField& field, const AlignOptions& options,
                     const CellTask& task) {
  using Vector = Eigen::Matrix<double, kFitted, 1>;
  const auto& [x, y, map, noise, before] =
      std::tie(task.patch.x, task.patch.y, task.patch.map, task.patch.noise, task.patch.state);
  const int half = task.window_px / 2, third = (task.window_px - 1) / 6;
  const auto part_of = [&](int off) { return off < -third ? 0 : off > third ? 2 : 1; };
  Eigen::Matrix<double, kFitted, kFitted> normal = Eigen::Matrix<double, kFitted, kFitted>::Zero();
  Vector right = Vector::Zero();
  struct Pixel {
    Vector row;
    double off, weight;
    int ninth;
  };
  std::vector<Pixel> seen;
  PlainStep result{.state = before};
  double squares = 0, weights = 0, agreed = 0;
  const double sigma = std::hypot(noise, options.misfit_share * before.gain), scale = options.outlier_sigmas * sigma;
  for (int down = -half; down <= half; ++down) {
    for (int along = -half; along <= half; ++along) {
      if (x + along < 0 || y + down < 0 || x + along >= frame.width || y + down >= frame.height) continue;
      const double level = frame.at(x + along, y + down);
      const Eigen::Vector2f off_px(static_cast<float>(along), static_cast<float>(down));
      const Eigen::Vector2f p = projector_offset(map, before, off_px) + map.origin_px.cast<float>();
      const double inside =
          std::min<double>(1, task.square_half_px - (p - task.square_middle_px).cwiseAbs().maxCoeff());
      if (inside <= 0) continue;
      const PatternField::Sample light = field.at(p.x(), p.y());
      const double g = light.slope_u * map.along.x() + light.slope_v * map.along.y(),
                   c = light.slope_v * map.along.x() - light.slope_u * map.along.y();
      double off =
          level - before.offset - light.value * (before.gain + before.gain_x * off_px.x() + before.gain_y * off_px.y());
      double knows = 1;
      if (level >= full) {
        const double reach = before.gain > 0 ? kCensoredSigmas * sigma : -std::numeric_limits<double>::max();
        knows = off <= -reach ? 0 : off >= reach ? 1 : (off + reach) / (2 * reach);
        off = off <= -reach ? 0 : off >= reach ? off : (off + reach) / 2;
      }
      const double agrees = before.gain > 0 ? inside * std::pow(1 + std::pow(off / scale, 2), -2) : inside;
      const double weight = knows * agrees;
      Pixel& pixel = seen.emplace_back();
      pixel.row << g, g * off_px.x(), g * off_px.y(), c, light.value, light.value * off_px.x(),
          light.value * off_px.y(), 1;
      pixel.off = off, pixel.weight = weight, pixel.ninth = 3 * part_of(down) + part_of(along);
      normal += weight * pixel.row * pixel.row.transpose(), right += weight * off * pixel.row;
      squares += weight * off * off, weights += weight, agreed += agrees, result.pixels += inside;
    }
  }
  result.support = agreed / std::max(1.0, result.pixels);
  const AlignPriors priors = align_priors(options, noise, before.gain);
  normal(3, 3) += priors.across, right[3] -= priors.across * before.gain * before.across;
  normal(5, 5) += priors.gain_slope, right[5] -= priors.gain_slope * before.gain_x;
  normal(6, 6) += priors.gain_slope, right[6] -= priors.gain_slope * before.gain_y;
  const Eigen::LDLT<Eigen::Matrix<double, kFitted, kFitted>> solver(normal);
  const Vector step = solver.solve(right);
  const double gain = before.gain + step[4];
  result.solved = weights > 2 * kFitted && solver.isPositive() && step.allFinite() && gain > noise;
  if (!result.solved) return result;
  const auto moved = [&](int k) { return static_cast<float>(std::clamp(step[k] / gain, -1.0, 1.0)); };
  PatchState& after = result.state;
  after.disparity += moved(0), after.slope_x += moved(1), after.slope_y += moved(2), after.across += moved(3);
  after.gain = static_cast<float>(gain), after.offset += static_cast<float>(step[7]);
  after.gain_x += static_cast<float>(step[5]), after.gain_y += static_cast<float>(step[6]);
  const double left = std::max(0.0, squares - step.dot(right));
  result.residual = std::sqrt(left / weights);
  result.covariance = solver.solve(decltype(normal)::Identity().eval()) / (gain * gain);
  double gr[9]{}, gg[9]{}, beyond = 0, all = 0;
  for (const Pixel& pixel : seen) {
    gr[pixel.ninth] += pixel.weight * pixel.row[0] * (pixel.off - pixel.row.dot(step));
    gg[pixel.ninth] += pixel.weight * pixel.row[0] * pixel.row[0];
  }
  for (int k = 0; k < 9; ++k)
    if (gg[k] > 0) beyond += gr[k] * gr[k] / gg[k] - left / weights, all += gg[k];
  result.scatter = std::sqrt(std::max(0.0, beyond) / all) / gain;
  return result;
}

}  // namespace slsd::test
