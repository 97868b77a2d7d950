// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include "core/result.hpp"

namespace slsd {

/// Conditions under which symbols are looked at.
struct LookOptions {
  int symbol_size_px = 16;
  int spacing_px = 2;
  double camera_px_per_projector_px = 1.4;  ///< 1.4: camera 1600 px and projector 1280 px wide on the paper's rig
  double blur_px = 1.1;                     ///< standard deviation of the blur of projector and camera, camera px
  double noise = 0.02;                      ///< standard deviation, as a share of the contrast
  int looks = 160;                          ///< simulated looks at each symbol
  double frame_error = 0.07;  ///< largest error of the grid vectors that a look is measured by, as a share of them
};

/// A pair of symbols and how far apart they look: standard deviations from each one's mean to the boundary between them
/// along the direction that parts them best (Fisher's). 3 means one of 740 on the wrong side, if all were Gaussian.
struct SymbolPair {
  int first;
  int second;
  double distance;
};

/// Losses of one symbol in the simulated camera.
struct SymbolLoss {
  int number;
  double share;  ///< share of the looks in which it broke into pieces or grew together with a neighbour, 0 to 1
};

/// Distance below which a pair is risky. At 4 the Gaussian error is 1 in 30,000. Even tails ten times as heavy stay far
/// below the 2 % of symbols misread that a pattern of minimum distance 3 survives.
inline constexpr double kRiskyDistance = 4.0;

/// Loss above which a symbol is risky: a lost one is missing in the nine windows around it. The looks are of every tilt
/// that occurs. A pattern of which each symbol is lost in one of ten still decodes to nine tenths on a sculpture.
inline constexpr double kRiskyLoss = 0.15;

/// Distances between the members of a set of symbols.
struct Separability {
  std::vector<SymbolPair> pairs;   ///< all pairs, the closest first
  std::vector<SymbolLoss> losses;  ///< one for each symbol, in their order

  [[nodiscard]] double smallest_distance() const { return pairs.front().distance; }
  [[nodiscard]] std::vector<SymbolPair> risky_pairs() const;
  [[nodiscard]] std::vector<SymbolLoss> risky_symbols() const;
};

/// Looks at each of the symbols as the decoder's prototypes are made (core/decode/symbols/prototypes.hpp) and compares
/// the distributions of their features. The same arguments give the same answer.
/// @param symbols  2 to 25 different symbol numbers
/// @errors kInvalidArgument
/// @thread reentrant
[[nodiscard]] Result<Separability> assess_separability(const std::vector<int>& symbols, const LookOptions& options);

/// The warnings for a person, one to a line, empty where nothing is risky: "symbols 7 (square) and 3 (frame) look alike
/// at 8 px: ...".
[[nodiscard]] std::vector<std::string> separability_warnings(const Separability& separability, int symbol_size_px);

}  // namespace slsd
