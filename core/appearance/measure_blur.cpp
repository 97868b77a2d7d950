// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/appearance/measure_blur.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace slsd {
namespace {

using Row = Eigen::Matrix<float, kFitted, 1>;

/// Share of an unknown's square sum that the other unknowns have to leave.
constexpr float kKnownMin = 1e-3F;

/// Half the Laplacian of the pattern, from the field's slopes.
float half_laplacian(const PatternField& field, float u, float v) {
  constexpr float kOff = 1.F / PatternField::kSamplesPerPx;
  const float along_u = field.at(u + kOff, v).slope_u - field.at(u - kOff, v).slope_u,
              along_v = field.at(u, v + kOff).slope_v - field.at(u, v - kOff).slope_v;
  return 0.5F * (along_u + along_v) / (2 * kOff);
}

/// Changes of the blur and of the tone curve.
constexpr int kChanges = 2;
enum Change { kOfBlur, kOfTone };
using Changes = Eigen::Matrix<float, kChanges, 1>;

/// Normal equations of a patch, with the changes beside the other unknowns.
struct Sums {
  Eigen::Matrix<float, kFitted, kFitted> normal = Eigen::Matrix<float, kFitted, kFitted>::Zero();
  Row right = Row::Zero();
  Eigen::Matrix<float, kFitted, kChanges> with_changes = Eigen::Matrix<float, kFitted, kChanges>::Zero();
  Eigen::Matrix<float, kChanges, kChanges> changes = Eigen::Matrix<float, kChanges, kChanges>::Zero();
  Changes changes_right = Changes::Zero();
};

/// Change of a level with the power of the tone curve, from a power of one.
float by_tone(float level, float full) {
  constexpr float kDarkest = 1e-3F;
  const float light = std::clamp(level / full, kDarkest, 1.F);
  return full * light * std::log(light);
}

template <class T>
Sums sum_up(const ImageView<T>& frame, double full, const PatternField& field, const AlignOptions& options,
            const CellTask& task) {
  const PatchTask& patch = task.patch;
  const PatchMap& map = patch.map;
  const PatchState& state = patch.state;
  const float sigma = std::hypot(patch.noise, options.misfit_share * state.gain),
              per_scale = 1 / (options.outlier_sigmas * sigma);
  const int half = task.window_px / 2;
  const int left = std::max(-half, -patch.x), right = std::min(half, frame.width - 1 - patch.x),
            top = std::max(-half, -patch.y), bottom = std::min(half, frame.height - 1 - patch.y);
  Sums sums;
  for (int y = top; y <= bottom; ++y) {
    for (int x = left; x <= right; ++x) {
      const auto level = static_cast<float>(frame.at(patch.x + x, patch.y + y));
      const Eigen::Vector2f off(static_cast<float>(x), static_cast<float>(y));
      const Eigen::Vector2f p = projector_offset(map, state, off) + map.origin_px.cast<float>();
      if ((p - task.square_middle_px).cwiseAbs().maxCoeff() > task.square_half_px) continue;
      const PatternField::Sample light = field.at(p.x(), p.y());
      const float gain = state.gain + state.gain_x * off.x() + state.gain_y * off.y();
      float residual = level - state.offset - gain * light.value, weight = 1;
      if (static_cast<double>(level) >= full) {
        const Censored clipped = censored(residual, sigma);
        residual = clipped.residual, weight = clipped.weight;
      }
      const float off_scale = residual * per_scale, agrees = 1 / (1 + off_scale * off_scale);
      weight *= agrees * agrees;
      const float g = gain * (light.slope_u * map.along.x() + light.slope_v * map.along.y()),
                  c = gain * (light.slope_v * map.along.x() - light.slope_u * map.along.y());
      const Changes by(gain * half_laplacian(field, p.x(), p.y()),
                       by_tone(state.offset + gain * light.value, static_cast<float>(full)));
      Row row;
      row << g, g * off.x(), g * off.y(), c, light.value, light.value * off.x(), light.value * off.y(), 1;
      sums.normal += weight * row * row.transpose();
      sums.right += weight * residual * row, sums.with_changes += weight * row * by.transpose();
      sums.changes += weight * by * by.transpose(), sums.changes_right += weight * residual * by;
    }
  }
  return sums;
}

}  // namespace

std::optional<PatchBlur> blur_of_patch(const GreyView& frame, double full, const PatternField& field,
                                       const AlignOptions& options, const CellTask& task) {
  if (task.patch.failed || !(task.patch.state.gain > 0)) return std::nullopt;
  const Sums sums = std::visit([&](const auto& pixels) { return sum_up(pixels, full, field, options, task); }, frame);
  const Eigen::LDLT<Eigen::Matrix<float, kFitted, kFitted>> others(sums.normal);
  if (others.info() != Eigen::Success || !others.isPositive()) return std::nullopt;
  const Eigen::Matrix<float, kFitted, kChanges> explained = others.solve(sums.with_changes);
  const Eigen::Matrix<float, kChanges, kChanges> known = sums.changes - sums.with_changes.transpose() * explained;
  const Changes asked = sums.changes_right - explained.transpose() * sums.right;
  const float blur = known(kOfBlur, kOfBlur), both = known(kOfBlur, kOfTone);
  if (!(blur > kKnownMin * sums.changes(kOfBlur, kOfBlur)) || !asked.allFinite()) return std::nullopt;
  const float change = asked[kOfBlur] / blur;
  PatchBlur patch{change, blur, field.blur_sigma_px() * field.blur_sigma_px() + change, 0, 0};
  // A wrong blur must not pass for a tone curve: it is eliminated, too.
  const float tone = known(kOfTone, kOfTone) - both * both / blur;
  if (tone > kKnownMin * sums.changes(kOfTone, kOfTone))
    patch.tone_change = (asked[kOfTone] - both / blur * asked[kOfBlur]) / tone, patch.tone_weight = tone;
  return patch;
}

void BlurMeter::add(const PatchBlur& patch) {
  patches_.emplace_back(patch.change, patch.weight);
  if (patch.tone_weight > 0) tones_.emplace_back(patch.tone_change, patch.tone_weight);
}

std::optional<float> BlurMeter::weighted_median(Weighted& values) {
  if (values.empty()) return std::nullopt;
  std::ranges::sort(values);
  float all = 0, below = 0;
  for (const auto& [value, weight] : values) all += weight;
  for (const auto& [value, weight] : values)
    if (below += weight; 2 * below >= all) return value;
  return values.back().first;
}

float changed_blur_px(float blur_px, float change) {
  const float variance = blur_px * blur_px + change;
  const float blur = std::sqrt(std::max(0.F, variance));
  return std::clamp(std::clamp(blur, blur_px / 1.5F, blur_px * 1.5F), PatternFields::kBlurMinPx,
                    PatternFields::kBlurMaxPx);
}

}  // namespace slsd
