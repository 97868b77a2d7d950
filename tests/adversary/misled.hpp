// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <vector>

#include "core/decode/decoder.hpp"
#include "core/result.hpp"
#include "tests/adversary/frames.hpp"

namespace slsd::adversary {

/// How far from its place a point may be that is right.
inline constexpr double kTolerancePx = 1.5;

/// Decoders of one pattern, and the frames that would mislead them.
struct Misled {
  FrameMaker maker;
  std::vector<Decoder> decoders;  ///< one to each of three working depths

  /// Of a pattern in which runs of letters recur, which is the harder test: 16px-5 or 8px-6.
  /// @param symbol_size_px   16 or 8
  /// @param trial            of all decoders; outlives them
  /// @param wrong_cells_max  see DecodeOptions
  /// @errors as make_pattern() and Decoder::create()
  [[nodiscard]] static Result<Misled> of(int symbol_size_px, RuleTrial* trial = nullptr,
                                         double wrong_cells_max = DecodeOptions().wrong_cells_max);
  /// The same with any pattern. The foreign array is another one of the same options.
  [[nodiscard]] static Result<Misled> of(const Pattern& pattern, RuleTrial* trial, double wrong_cells_max);
};

}  // namespace slsd::adversary
