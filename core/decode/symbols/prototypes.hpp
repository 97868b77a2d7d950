// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/decode/symbols/shape_features.hpp"

namespace slsd {

/// Look of a symbol: the distribution of its features over blur, tilt, noise and position on the pixel grid.
struct Prototype {
  ShapeFeatures mean;
  Eigen::Matrix<float, kFeatureCount, kFeatureCount>
      whitening;                ///< features minus mean, times this, have unit covariance
  float density;                ///< density at the mean, up to a factor common to all: 1 / volume of the covariance
  Eigen::Vector2f centroid_px;  ///< centre of its grey moments, from the middle of its square, projector px
  Eigen::Vector2f steady_centroid_px;  ///< its steady centre, likewise

  /// Squared distance from the mean, in standard deviations.
  [[nodiscard]] float squared_distance(const ShapeFeatures& features) const {
    return whitening.lazyProduct(features - mean).squaredNorm();
  }
};

/// Conditions that the prototypes are made for.
struct PrototypeOptions {
  std::vector<int> symbols;
  int symbol_size_px = 16;
  int spacing_px = 2;
  float camera_px_per_projector_px = 1.4F;
  /// Error of the local frame in which the features are taken, as a share of a step. The calibration's expectation
  /// ignores the tilt of the surface; a frame measured from neighbours is off by a few hundredths.
  float frame_error = 0.05F;
  int samples = 120;  ///< simulated looks at each symbol
  /// Standard deviation of the blur of projector and camera, camera px, to a third; if missing, all that occur.
  std::optional<float> blur_px{};
  /// Standard deviation of the noise as a share of the contrast; if missing, all that occurs.
  std::optional<float> noise{};
};

using FeatureCovariance = Eigen::Matrix<double, kFeatureCount, kFeatureCount>;

/// Distribution of one symbol's features, and how often it has none.
struct SymbolSpread {
  Eigen::Matrix<double, kFeatureCount, 1> mean;
  FeatureCovariance covariance;  ///< includes the effects that the model leaves out
  double lost;                   ///< share of the looks in which it broke into pieces or grew together with a neighbour
};

/// One for each symbol, from the looks that show it whole and separate.
/// @thread reentrant
[[nodiscard]] std::vector<SymbolSpread> spread_of_symbols(const PrototypeOptions& options);

/// Draws each symbol among random neighbours many times as a camera would see it, and reads it with the decoder's own
/// stages. Keeps mean, covariance and centre of the features. The same options give the same prototypes.
/// @return one for each letter, in the order of `symbols`
/// @thread reentrant
[[nodiscard]] std::vector<Prototype> make_prototypes(const PrototypeOptions& options);

/// One set for each of several errors of the local frame; each has one prototype for each letter.
using PrototypeSets = std::vector<std::vector<Prototype>>;

/// The same for several errors of the local frame, in little more time than for one: the looks are shared.
/// @param frame_errors  replace that of the options
/// @return one set for each error
/// @thread reentrant
[[nodiscard]] PrototypeSets make_prototypes(const PrototypeOptions& options, std::span<const float> frame_errors);

/// The same for several blurs, which share the looks before they are blurred.
/// @param blurs_px  replace that of the options; all of drawn frames (is_drawn) or none
/// @return for each blur, one set for each error
/// @thread reentrant
[[nodiscard]] std::vector<PrototypeSets> make_prototypes(const PrototypeOptions& options,
                                                         std::span<const float> frame_errors,
                                                         std::span<const std::optional<float>> blurs_px);

/// Largest margin that follows a region's edge without reaching its neighbour.
[[nodiscard]] int margin_px(int spacing_px, float camera_px_per_projector_px);

/// Side of the tiles for the 3x3 thresholds: half the pitch in the camera.
[[nodiscard]] int threshold_tile_px(int pitch_px, float camera_px_per_projector_px);

/// Place of the threshold between dark and light. It is below the middle if the gaps are wide enough, so that a symbol
/// whose parts touch at a corner stays in one piece. It is less low for small symbols, as more of them run together.
[[nodiscard]] float threshold_level(int symbol_size_px, int spacing_px, float camera_px_per_projector_px);

}  // namespace slsd
