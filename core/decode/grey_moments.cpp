// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/grey_moments.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>

#include "core/decode/clones.hpp"

namespace slsd {
namespace {

constexpr float kOutside = -1.F;
/// What is left of the light at the dark end of a symbol, at the least.
constexpr float kLeastLight = 0.3F;

constexpr int kLanes = 8;  // rows of the patch are padded to whole vectors

struct Levels {
  float background, peak, noise;
};

/// Background and peak as the means of the lowest and the highest quarter of the range: single noisy pixels do not move
/// them.
SLSD_CLONES Levels find_levels(const float* patch, int count) {
  float low = std::numeric_limits<float>::max(), high = 0;
#pragma omp simd reduction(max : high) reduction(min : low)
  for (int i = 0; i < count; ++i) {
    const float value = patch[i];
    const float inside = value >= 0 ? value : std::numeric_limits<float>::max();
    high = value > high ? value : high;
    low = inside < low ? inside : low;
  }
  const float low_limit = low + 0.25F * (high - low), high_limit = high - 0.25F * (high - low);
  float low_sum = 0, high_sum = 0, high_squares = 0, low_count = 0, high_count = 0;
#pragma omp simd reduction(+ : low_sum, high_sum, high_squares, low_count, high_count)
  for (int i = 0; i < count; ++i) {
    const float value = patch[i];
    const float is_low = value >= 0 && value <= low_limit ? 1.F : 0.F;
    const float is_high = value >= high_limit ? 1.F : 0.F;
    const float above = is_high * (value - high_limit);
    low_sum += is_low * value;
    low_count += is_low;
    high_sum += above;
    high_squares += above * above;
    high_count += is_high;
  }
  if (low_count == 0 || high_count == 0) return {0, 0, 0};
  const float mean = high_sum / high_count;
  return {low_sum / low_count, high_limit + mean, std::sqrt(std::max(0.F, high_squares / high_count - mean * mean))};
}

/// Moments of the patch's weights about its first column's and row's pixel centres plus the middle; m[p][q] of x^p y^q.
SLSD_CLONES void sum_moments(const float* patch, int stride, int height, float middle_x, float middle_y, float offset,
                             float scale, float (&m)[4][4]) {
  for (int row = 0; row < height; ++row) {
    const float* pixels = patch + row * stride;
    float s0 = 0, s1 = 0, s2 = 0, s3 = 0;
#pragma omp simd reduction(+ : s0, s1, s2, s3)
    for (int i = 0; i < stride; ++i) {
      const float x = static_cast<float>(i) - middle_x;
      const float ramp = (pixels[i] - offset) * scale;
      const float lower = ramp > 0 ? ramp : 0.F;
      const float w = lower < 1 ? lower : 1.F;
      const float wx = w * x, wxx = wx * x;
      s0 += w;
      s1 += wx;
      s2 += wxx;
      s3 += wxx * x;
    }
    const float y = static_cast<float>(row) - middle_y;
    m[0][0] += s0, m[1][0] += s1, m[2][0] += s2, m[3][0] += s3;
    m[0][1] += y * s0, m[1][1] += y * s1, m[2][1] += y * s2;
    m[0][2] += y * y * s0, m[1][2] += y * y * s1;
    m[0][3] += y * y * y * s0;
  }
}

int padded(int width) {
  return (width + kLanes - 1) / kLanes * kLanes;
}

/// Raw moments about the patch's middle, to central ones over the weight.
GreyMoments central(const float (&m)[4][4], double middle_x, double middle_y) {
  GreyMoments g;
  if (m[0][0] <= 0) return g;
  const double n = 1 / static_cast<double>(m[0][0]);
  const double x = m[1][0] * n, y = m[0][1] * n;
  const double xx = m[2][0] * n, xy = m[1][1] * n, yy = m[0][2] * n;
  g.weight = m[0][0];
  g.x = static_cast<float>(middle_x + x);
  g.y = static_cast<float>(middle_y + y);
  g.m20 = static_cast<float>(xx - x * x);
  g.m11 = static_cast<float>(xy - x * y);
  g.m02 = static_cast<float>(yy - y * y);
  g.m30 = static_cast<float>(m[3][0] * n - 3 * x * xx + 2 * x * x * x);
  g.m21 = static_cast<float>(m[2][1] * n - 2 * x * xy - y * xx + 2 * x * x * y);
  g.m12 = static_cast<float>(m[1][2] * n - 2 * y * xy - x * yy + 2 * y * y * x);
  g.m03 = static_cast<float>(m[0][3] * n - 3 * y * yy + 2 * y * y * y);
  return g;
}

}  // namespace

template <class T>
void GreyMomentMeter::copy_patch(const ImageView<T>& frame, const Region& region, std::span<const Run> runs) {
  left_ = region.left - margin_px_, top_ = region.top - margin_px_;
  width_ = region.width_px() + 2 * margin_px_;
  height_ = region.height_px() + 2 * margin_px_;
  stride_ = padded(width_);
  first_.assign(static_cast<std::size_t>(height_), width_);
  last_.assign(static_cast<std::size_t>(height_), -1);
  for (const Run& run : runs) {
    for (int y = run.row - top_ - margin_px_; y <= run.row - top_ + margin_px_; ++y) {
      first_[y] = std::min(first_[y], run.left - left_ - margin_px_);
      last_[y] = std::max(last_[y], run.right - 1 - left_ + margin_px_);
    }
  }
  patch_.assign(static_cast<std::size_t>(stride_) * height_, kOutside);
  for (int y = 0; y < height_; ++y) {
    if (top_ + y < 0 || top_ + y >= frame.height) continue;
    const T* pixels = frame.row(top_ + y);
    float* row = patch_.data() + y * stride_;
    const int end = std::min(last_[y], frame.width - 1 - left_);
    for (int x = std::max(first_[y], -left_); x <= end; ++x) row[x] = static_cast<float>(pixels[left_ + x]);
  }
}

template <class T>
void GreyMomentMeter::copy_cell(const ImageView<T>& frame, const Eigen::Vector2f& centre_px,
                                const LatticeFrame& lattice_frame, float half_px) {
  const Eigen::Vector2f reach = half_px * lattice_frame.cwiseAbs().rowwise().sum();
  left_ = static_cast<int>(std::floor(centre_px.x() - reach.x())),
  top_ = static_cast<int>(std::floor(centre_px.y() - reach.y()));
  width_ = static_cast<int>(std::ceil(2 * reach.x())) + 2;
  height_ = static_cast<int>(std::ceil(2 * reach.y())) + 2;
  stride_ = padded(width_);
  const Eigen::Matrix2f inverse = lattice_frame.inverse();
  patch_.assign(static_cast<std::size_t>(stride_) * height_, kOutside);
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      if (!frame.contains(left_ + x, top_ + y)) continue;
      const Eigen::Vector2f from_centre(static_cast<float>(left_ + x) - centre_px.x(),
                                        static_cast<float>(top_ + y) - centre_px.y());
      if ((inverse * from_centre).cwiseAbs().maxCoeff() > half_px) continue;
      patch_[y * stride_ + x] = static_cast<float>(frame.at(left_ + x, top_ + y));
    }
  }
}

void GreyMomentMeter::level_light(const Eigen::Vector2f& centre_px, const Eigen::Vector2f& shading) {
  const float background = find_levels(patch_.data(), stride_ * height_).background;
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      float& value = patch_[y * stride_ + x];
      if (value < 0) continue;
      const float light = 1 + shading.x() * (static_cast<float>(left_ + x) - centre_px.x()) +
                          shading.y() * (static_cast<float>(top_ + y) - centre_px.y());
      value = std::max(0.F, background + (value - background) / std::max(light, kLeastLight));
    }
  }
}

GreyMoments GreyMomentMeter::weigh_patch() const {
  const Levels levels = find_levels(patch_.data(), stride_ * height_);
  const float range = levels.peak - levels.background;
  if (!(range > 0)) return {};

  const float offset = levels.background + kRampStart * range;
  const float scale = 1.F / ((kRampEnd - kRampStart) * range);
  const float middle_x = 0.5F * static_cast<float>(width_ - 1), middle_y = 0.5F * static_cast<float>(height_ - 1);
  float m[4][4] = {};
  sum_moments(patch_.data(), stride_, height_, middle_x, middle_y, offset, scale, m);
  GreyMoments moments = central(m, static_cast<float>(left_) + middle_x, static_cast<float>(top_) + middle_y);
  moments.noise = levels.noise;
  moments.background = levels.background;
  moments.peak = levels.peak;
  return moments;
}

template <class T>
GreyMoments GreyMomentMeter::measure(const ImageView<T>& frame, const Region& region, std::span<const Run> runs,
                                     const Eigen::Vector2f& shading) {
  copy_patch(frame, region, runs);
  if (!shading.isZero()) {
    const Eigen::Vector2f middle(0.5F * static_cast<float>(region.left + region.right),
                                 0.5F * static_cast<float>(region.top + region.bottom));
    level_light(middle, shading);
  }
  return weigh_patch();
}

template <class T>
GreyMoments GreyMomentMeter::measure_cell(const ImageView<T>& frame, const Eigen::Vector2f& centre_px,
                                          const LatticeFrame& lattice_frame, float half_px,
                                          const Eigen::Vector2f& shading) {
  copy_cell(frame, centre_px, lattice_frame, half_px);
  level_light(centre_px, shading);
  return weigh_patch();
}

using View8 = ImageView<std::uint8_t>;
using View16 = ImageView<std::uint16_t>;
template GreyMoments GreyMomentMeter::measure(const View8&, const Region&, std::span<const Run>,
                                              const Eigen::Vector2f&);
template GreyMoments GreyMomentMeter::measure(const View16&, const Region&, std::span<const Run>,
                                              const Eigen::Vector2f&);
template GreyMoments GreyMomentMeter::measure_cell(const View8&, const Eigen::Vector2f&, const LatticeFrame&, float,
                                                   const Eigen::Vector2f&);
template GreyMoments GreyMomentMeter::measure_cell(const View16&, const Eigen::Vector2f&, const LatticeFrame&, float,
                                                   const Eigen::Vector2f&);

}  // namespace slsd
