// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>
#include <vector>

#include "core/decode/centres/align_letters.hpp"

namespace slsd {

/// Finds the places of symbols that print, relief or an edge has spoilt: a centroid goes with what is missing, and off
/// its epipolar line. What there is of them is aligned with the letter of the cell that was proposed, from where their
/// neighbours put them. This says where a symbol is, and that it shows its letter; CellInference decides on its cell.
/// @thread thread-bound: keeps its buffers; the letters are shared with copies
class SymbolMender {
 public:
  SymbolMender(const Pattern& pattern, const std::shared_ptr<const LetterFields>& letters, Rules rules = {});

  /// Mended symbols get another place, frame, light, shape and misfit, and hold those beside them.
  /// @param scene  whose claims are proposals
  /// @return       the sightings that are mended, in their order; stands until the next call
  const std::vector<std::int32_t>& mend(const LetterScene& scene);

 private:
  void ask_all(const LetterScene& scene);
  void ask_beside(const LetterScene& scene, std::size_t first);
  void mend_asked(const LetterScene& scene);
  [[nodiscard]] bool lies_there(Sightings& seen, const AskedLetter& asked) const;
  [[nodiscard]] bool shows_letter(const LetterScene& scene, const AskedLetter& asked) const;

  float pitch_px_;
  Rules rules_;
  LetterAligner aligner_;
  std::vector<std::int32_t> to_ask_, mended_, around_;  // sightings
};

}  // namespace slsd
