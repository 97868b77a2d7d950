// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/decode/rules.hpp"
#include "core/result.hpp"

namespace slsd {

enum class Method { kDefault, kPaper };
enum class Precision { kStandard, kFine };
/// What a cloud has a point for.
enum class Density { kSymbols, kPixels };

/// What the keys of [decode] say of clouds with a point for each pixel.
struct DenseOptions {
  int stride_px = 4;      ///< dense_stride_px, 1 to 16; the surface is fitted every so many camera pixels
  double prune_px = 1.5;  ///< dense_prune_px, 0 to 16; points this close to a hole or a jump in depth are dropped

  [[nodiscard]] Result<> validate() const;
  friend bool operator==(const DenseOptions&, const DenseOptions&) = default;
};

/// The [decode] table of the configuration. Every stage can be run the paper's way, so that both can be measured side
/// by side.
struct DecodeOptions {
  double depth_min_mm = 400.0;  ///< working range along the camera's z axis; cuts the candidates of a codeword
  double depth_max_mm = 2500.0;
  /// How many a frame that is made to mislead may have on average: sets the margin; 1e-9 to 1.
  double wrong_cells_max = 0.005;
  /// kFine: each decoded symbol's patch is aligned with the pattern, which takes several times as long.
  Precision precision = Precision::kStandard;
  Density density = Density::kSymbols;  ///< unless a request says
  DenseOptions dense = {};
  Method binarize = Method::kDefault;
  Method find_regions = Method::kDefault;  ///< the paper's way leaves regions merged that ran together
  Method classify = Method::kDefault;
  Method centre = Method::kDefault;
  Method link_grid = Method::kDefault;
  Method decode_windows = Method::kDefault;
  Method correspond = Method::kDefault;
  RuleTrial* trial = nullptr;  ///< of tools and tests alone; outlives the decoder

  [[nodiscard]] Result<> validate() const;
  /// Of the working range, by ratio: 1000 of 500 and 2000.
  [[nodiscard]] double middle_depth_mm() const;
  /// Whether any stage goes the paper's way.
  [[nodiscard]] bool any_paper() const;
  friend bool operator==(const DecodeOptions&, const DecodeOptions&) = default;
};

}  // namespace slsd
