// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>
#include <vector>

#include "core/code/codebook.hpp"
#include "core/decode/centres/align_letters.hpp"

namespace slsd {

/// Finds the places of symbols that print, relief or an edge has damaged. A missing part displaces the centroid, also
/// off its epipolar line. SymbolRecovery aligns the visible part with the letter of the proposed cell, starting at the
/// place that the neighbours predict. The result is a place, and that the symbol shows its letter; CellInference
/// decides on its cell.
/// @thread thread-bound: keeps its buffers; the letters are shared with copies
class SymbolRecovery {
 public:
  SymbolRecovery(const IndexedPattern& pattern, const std::shared_ptr<const LetterFields>& letters, Rules rules = {});

  /// Recovered symbols get a new place, frame, light, shape and misfit, and then hold their neighbours.
  /// @param scene  its claims are proposals
  /// @return       the recovered sightings, in order; valid until the next call
  const std::vector<std::int32_t>& recover(const LetterScene& scene, Executor& executor);

 private:
  void ask_all(const LetterScene& scene);
  void ask_beside(const LetterScene& scene, std::size_t first);
  void find_printed(const LetterScene& scene, Executor& executor) const;
  void recover_asked(const LetterScene& scene, Executor& executor);
  [[nodiscard]] bool lies_there(Sightings& seen, const AskedLetter& asked) const;
  [[nodiscard]] bool shows_letter(const LetterScene& scene, const AskedLetter& asked) const;

  float pitch_px_;
  Rules rules_;
  LetterAligner aligner_;
  std::vector<std::int32_t> to_ask_, recovered_;  // sightings
  std::vector<std::uint8_t> shown_;               // for each asked letter
};

}  // namespace slsd
