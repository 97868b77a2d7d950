// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/appearance/blurred_pattern.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Cholesky>

namespace slsd {
namespace {

/// Scatter of a patch's variance, projector px^2, and the usual size of the terms beyond the first. Measured on
/// rendered frames: docs/notes/2026-11-dense.md.
constexpr float kScatter = 0.02F, kUsualTerm = 0.1F;
/// Number of patches below which a blur counts as even.
constexpr std::size_t kSamplesLeast = 16;
/// Logarithm of the ratio of the blurs in a frame above which it needs several fields.
constexpr float kUneven = 0.08F;
/// Share that the blurs of these are rounded to: so the frames of a stream share them.
constexpr float kRounded = 0.04F;
/// Change of the variance up to which a field suits, a share of it.
constexpr float kSuits = 0.12F;
/// Number of times that levels move to the middle of their samples.
constexpr int kPasses = 4;

float log_blur(float variance) {
  constexpr float kLeast = PatternFields::kBlurMinPx * PatternFields::kBlurMinPx;
  return 0.5F * std::log(std::max(kLeast, variance));
}

/// @return the index of the value that is nearest
int nearest(std::span<const float> values, float to) {
  const auto off = [&](float value) { return std::abs(value - to); };
  return static_cast<int>(std::ranges::min_element(values, {}, off) - values.begin());
}

}  // namespace

BlurOverFrame::BlurOverFrame(std::span<const BlurSample> samples) {
  if (samples.empty()) return;
  Eigen::Vector2f low = samples[0].camera_px, high = low;
  float near = samples[0].inverse_depth, far = near;
  for (const BlurSample& sample : samples) {
    low = low.cwiseMin(sample.camera_px), high = high.cwiseMax(sample.camera_px);
    near = std::max(near, sample.inverse_depth), far = std::min(far, sample.inverse_depth);
  }
  middle_px_ = 0.5F * (low + high), middle_inverse_depth_ = 0.5F * (near + far);
  per_px_ = 2 / std::max(1.F, (high - low).maxCoeff());
  per_inverse_depth_ = near > far ? 2 / (near - far) : 0;
  for (int pass = 0; pass < 5; ++pass) {
    Eigen::Matrix<float, 6, 6> normal = Eigen::Matrix<float, 6, 6>::Zero();
    Terms right = Terms::Zero();
    for (const BlurSample& sample : samples) {
      const Terms row = row_at(sample.camera_px, sample.inverse_depth);
      const float off = (sample.variance - row.dot(terms_)) / kScatter;
      const float weight = pass == 0 ? 1 : 1 / (1 + off * off);
      normal += weight * row * row.transpose(), right += weight * sample.variance * row;
    }
    normal.diagonal().tail<5>().array() += kScatter * kScatter / (kUsualTerm * kUsualTerm);
    const Terms terms = normal.ldlt().solve(right);
    if (!terms.allFinite()) break;
    terms_ = terms;
  }
  least_ = std::numeric_limits<float>::max(), most_ = std::numeric_limits<float>::lowest();
  for (const BlurSample& sample : samples) {
    const float there = row_at(sample.camera_px, sample.inverse_depth).dot(terms_);
    least_ = std::min(least_, there), most_ = std::max(most_, there);
  }
}

BlurOverFrame::Terms BlurOverFrame::row_at(const Eigen::Vector2f& camera_px, float inverse_depth) const {
  const Eigen::Vector2f at = per_px_ * (camera_px - middle_px_);
  const float q = per_inverse_depth_ * (inverse_depth - middle_inverse_depth_);
  Terms row;
  row << 1, at.x(), at.y(), at.squaredNorm(), q, q * q;
  return row;
}

float BlurOverFrame::variance_at(const Eigen::Vector2f& camera_px, float inverse_depth) const {
  return std::clamp(row_at(camera_px, inverse_depth).dot(terms_), least_, most_);
}

BlurredPattern::BlurredPattern(std::shared_ptr<const PatternField> even) : levels_(1), fields_{std::move(even)} {}

BlurredPattern::BlurredPattern(const PatternFields& fields, float blur_px, std::span<const BlurSample> samples)
    : blur_(samples) {
  const float narrowest = log_blur(blur_.least()), range = log_blur(blur_.most()) - narrowest;
  if (samples.size() < kSamplesLeast || range < kUneven) {
    levels_ = 1, fields_[0] = fields.at(blur_px);
    return;
  }
  // Levels that lie evenly, then each in the middle of its samples (Lloyd 1982).
  const int count = std::min(kLevelsMost, static_cast<int>(std::ceil(range / kUneven)));
  std::array<float, kLevelsMost> all{};
  const std::span middles = std::span(all).first(count);
  for (int level = 0; level < count; ++level)
    middles[level] = narrowest + range * (static_cast<float>(level) + 0.5F) / static_cast<float>(count);
  for (int pass = 0; pass < kPasses; ++pass) move_to_samples(samples, middles);
  for (const float middle : middles) {
    auto field = fields.at(std::exp(middle), kRounded);
    if (levels_ > 0 && field == fields_[levels_ - 1]) continue;
    variances_[levels_] = field->blur_sigma_px() * field->blur_sigma_px();
    fields_[levels_++] = std::move(field);
  }
  usual_ = nearest(std::span(variances_).first(levels_), blur_px * blur_px);
}

/// Moves each level's blur, a logarithm, to the mean of the samples that are nearest to it.
void BlurredPattern::move_to_samples(std::span<const BlurSample> samples, std::span<float> middles) const {
  std::array<float, kLevelsMost> sums{}, counts{};
  for (const BlurSample& sample : samples) {
    const float blur = log_blur(blur_.variance_at(sample.camera_px, sample.inverse_depth));
    const int level = nearest(middles, blur);
    sums[level] += blur, counts[level] += 1;
  }
  for (std::size_t level = 0; level < middles.size(); ++level)
    if (counts[level] > 0) middles[level] = sums[level] / counts[level];
}

int BlurredPattern::level_at(const Eigen::Vector2f& camera_px, float inverse_depth) const {
  if (levels_ < 2) return 0;
  return nearest(std::span(variances_).first(levels_), blur_.variance_at(camera_px, inverse_depth));
}

bool BlurredPattern::suits(int level, const Eigen::Vector2f& camera_px, float inverse_depth) const {
  if (levels_ < 2) return true;
  return std::abs(blur_.variance_at(camera_px, inverse_depth) - variances_[level]) < kSuits * variances_[level];
}

}  // namespace slsd
