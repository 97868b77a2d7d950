// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include "core/result.hpp"

namespace slsd {

/// Conditions under which symbols are viewed.
struct LookOptions {
  int symbol_size_px = 16;
  int spacing_px = 2;
  double camera_px_per_projector_px = 1.4;  ///< 1.4: camera 1600 px and projector 1280 px wide on the paper's rig
  double blur_px = 1.1;                     ///< standard deviation of the blur of projector and camera, camera px
  double noise = 0.02;                      ///< standard deviation, as a share of the contrast
  int looks = 160;                          ///< simulated looks at each symbol
  double frame_error = 0.07;                ///< largest error of the local frame of a look, as a share
};

/// A pair of symbols and their separation: standard deviations from each mean to the boundary between them along the
/// direction that separates them best (Fisher's). At 3, one of 740 would be on the wrong side, if both were Gaussian.
struct SymbolPair {
  int first;
  int second;
  double distance;
};

/// Losses of one symbol in the simulated camera.
struct SymbolLoss {
  int number;
  double share;  ///< share of the looks in which it broke into pieces or merged with a neighbour, 0 to 1
};

/// Distance below which a pair is risky. At 4 the Gaussian error is 1 in 30,000. Even tails ten times as heavy stay far
/// below 2 % of misread symbols, which a pattern of minimum distance 3 tolerates.
inline constexpr double kRiskyDistance = 4.0;

/// Loss above which a symbol is risky: a lost symbol is missing in nine windows. The looks cover every tilt that
/// occurs. On a sculpture, a pattern that loses one in ten of each symbol still decodes to nine tenths.
inline constexpr double kRiskyLoss = 0.15;

/// Distances between the members of a set of symbols.
struct Separability {
  std::vector<SymbolPair> pairs;   ///< all pairs, the closest first
  std::vector<SymbolLoss> losses;  ///< one for each symbol, in their order

  [[nodiscard]] double smallest_distance() const { return pairs.front().distance; }
  [[nodiscard]] std::vector<SymbolPair> risky_pairs() const;
  [[nodiscard]] std::vector<SymbolLoss> risky_symbols() const;
};

/// Views each symbol as the decoder's prototypes are made (core/decode/symbols/prototypes.hpp) and compares the
/// distributions of their features. The same arguments give the same answer.
/// @param symbols  2 to 25 different symbol numbers
/// @errors kInvalidArgument
/// @thread reentrant
[[nodiscard]] Result<Separability> assess_separability(const std::vector<int>& symbols, const LookOptions& options);

/// Warnings for the user, one per line, empty if nothing is risky: "symbols 7 (square) and 3 (frame) look alike at 8
/// px: ...".
[[nodiscard]] std::vector<std::string> separability_warnings(const Separability& separability, int symbol_size_px);

}  // namespace slsd
