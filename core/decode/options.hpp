// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/decode/rules.hpp"
#include "core/result.hpp"

namespace slsd {

enum class Method { kDefault, kPaper };
enum class Precision { kStandard, kFine };
/// The kind of points in a cloud: one for each symbol or for each pixel.
enum class Density { kSymbols, kPixels };

/// Settings for clouds with a point for each pixel: the dense_ keys of [decode].
struct DenseOptions {
  int stride_px = 4;      ///< dense_stride_px, 1 to 16; the surface is fitted every so many camera pixels
  double prune_px = 1.5;  ///< dense_prune_px, 0 to 16; points this close to a hole or a jump in depth are dropped

  [[nodiscard]] Result<> validate() const;
  friend bool operator==(const DenseOptions&, const DenseOptions&) = default;
};

/// The [decode] table of the configuration. Each stage can run by the paper's method, so that both methods can be
/// compared.
struct DecodeOptions {
  double depth_min_mm = 400.0;  ///< working range along the camera's z axis; limits the candidate cells of a codeword
  double depth_max_mm = 2500.0;
  /// Mean number of wrong cells allowed in a frame that is made to mislead: sets the margin; 1e-9 to 1.
  double wrong_cells_max = 0.005;
  /// Alignment with the pattern: kFine aligns each decoded symbol's patch, which takes several times as long.
  Precision precision = Precision::kStandard;
  Density density = Density::kSymbols;  ///< unless a request sets it
  DenseOptions dense = {};
  Method binarize = Method::kDefault;
  Method find_regions = Method::kDefault;  ///< the paper's method keeps regions that ran together merged
  Method classify = Method::kDefault;
  Method centre = Method::kDefault;
  Method link_grid = Method::kDefault;
  Method decode_windows = Method::kDefault;
  Method correspond = Method::kDefault;
  RuleTrial* trial = nullptr;  ///< only for tools and tests; outlives the decoder

  [[nodiscard]] Result<> validate() const;
  /// Geometric middle of the working range: 1000 for 500 and 2000.
  [[nodiscard]] double middle_depth_mm() const;
  /// Tells whether any stage uses the paper's method.
  [[nodiscard]] bool any_paper() const;
  friend bool operator==(const DecodeOptions&, const DecodeOptions&) = default;
};

}  // namespace slsd
