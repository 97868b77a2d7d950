// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <memory>
#include <span>

#include <Eigen/Core>

#include "core/appearance/pattern_field.hpp"

namespace slsd {

/// The blur that a patch shows.
struct BlurSample {
  Eigen::Vector2f camera_px;
  float inverse_depth;  ///< 1/mm
  float variance;       ///< projector px^2
};

/// The blur over a frame. A lens out of focus blurs by a disc whose radius is linear in the inverse depth, and more off
/// its axis. So the variance is of the second order in both: c0 + c1 x + c2 y + c3 (x^2 + y^2) + c4 q + c5 q^2, with q
/// the inverse depth.
class BlurOverFrame {
 public:
  /// Fits the terms to samples, with small weights for outliers and a prior of an even blur.
  explicit BlurOverFrame(std::span<const BlurSample> samples);
  /// Returns the variance, projector px^2, within the range of those at the samples.
  [[nodiscard]] float variance_at(const Eigen::Vector2f& camera_px, float inverse_depth) const;
  [[nodiscard]] float least() const { return least_; }
  [[nodiscard]] float most() const { return most_; }
  /// Moves the origin of the camera's pixels to one of them.
  void move_origin(const Eigen::Vector2f& to) { middle_px_ -= to; }

 private:
  using Terms = Eigen::Matrix<float, 6, 1>;
  [[nodiscard]] Terms row_at(const Eigen::Vector2f& camera_px, float inverse_depth) const;

  Eigen::Vector2f middle_px_ = Eigen::Vector2f::Zero();
  float per_px_ = 0, middle_inverse_depth_ = 0, per_inverse_depth_ = 0;
  Terms terms_ = Terms::Zero();
  float least_ = 0, most_ = 0;
};

/// The pattern as a frame shows it: one field if the frame's blur is even, or else a few, each where its blur is the
/// nearest.
class BlurredPattern {
 public:
  BlurredPattern() = default;
  /// The same blur everywhere.
  explicit BlurredPattern(std::shared_ptr<const PatternField> even);
  /// @param even  outlives the pattern
  explicit BlurredPattern(const PatternField& even) : BlurredPattern({std::shared_ptr<void>(), &even}) {}
  /// @param blur_px  the frame's usual blur, standard deviation in projector px
  BlurredPattern(const PatternFields& fields, float blur_px, std::span<const BlurSample> samples);

  [[nodiscard]] explicit operator bool() const { return levels_ > 0; }
  [[nodiscard]] int levels() const { return levels_; }
  [[nodiscard]] const PatternField& field(int level) const { return *fields_[level]; }
  /// Returns the field that is nearest to the frame's usual blur.
  [[nodiscard]] const PatternField& usual() const { return *fields_[usual_]; }
  /// The level of the blur there, from the narrowest one on.
  [[nodiscard]] int level_at(const Eigen::Vector2f& camera_px, float inverse_depth) const;
  /// Tells whether a level's field comes near enough to the blur there, even if another is nearer.
  [[nodiscard]] bool suits(int level, const Eigen::Vector2f& camera_px, float inverse_depth) const;
  /// See BlurOverFrame::move_origin().
  void move_origin(const Eigen::Vector2f& to) { blur_.move_origin(to); }

  static constexpr int kLevelsMost = 3;

 private:
  void move_to_samples(std::span<const BlurSample> samples, std::span<float> middles) const;

  int levels_ = 0, usual_ = 0;
  std::array<std::shared_ptr<const PatternField>, kLevelsMost> fields_;
  std::array<float, kLevelsMost> variances_{};  // of the fields, projector px^2
  BlurOverFrame blur_{{}};
};

}  // namespace slsd
