// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/adversary/misled.hpp"

#include <utility>

namespace slsd::adversary {

Result<Misled> Misled::of(int symbol_size_px, RuleTrial* trial, double wrong_cells_max) {
  PatternOptions options{.symbol_size_px = symbol_size_px, .method = ArrayMethod::kConstructive};
  if (symbol_size_px == 16) options.symbols = {11, 13, 14, 18, 19};
  const auto pattern = make_pattern(options);
  return pattern ? of(*pattern, trial, wrong_cells_max) : tl::unexpected(pattern.error());
}

Result<Misled> Misled::of(const Pattern& pattern, RuleTrial* trial, double wrong_cells_max) {
  PatternOptions options = pattern.options;
  options.seed += 1;
  const auto foreign = make_pattern(options);
  if (!foreign) return tl::unexpected(foreign.error());
  Misled misled{FrameMaker(pattern, foreign->array), {}};
  const IndexedPattern indexed(pattern);
  for (const auto& [nearest, farthest] : {std::pair(350., 3200.), {400., 2500.}, {1500., 2500.}}) {
    auto decoder = Decoder::create(
        indexed, misled.maker.calibration(), 0,
        {.depth_min_mm = nearest, .depth_max_mm = farthest, .wrong_cells_max = wrong_cells_max, .trial = trial});
    if (!decoder) return tl::unexpected(decoder.error());
    misled.decoders.push_back(std::move(*decoder));
  }
  return misled;
}

}  // namespace slsd::adversary
