// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>
#include <vector>

#include "core/decode/centres/align_letters.hpp"
#include "core/decode/centres/mend_groups.hpp"

namespace slsd {

/// Finds the places of symbols whose cells are certain and whose shapes print, relief or an edge has spoilt: a centroid
/// goes with what is missing, and off its epipolar line. What there is of them is aligned with their letter instead,
/// from where at least two of their island put them, and what does not agree counts little. One is enough where they
/// fit the grid tightly, or two that are worn lie beside each other, as along a line of print: these have to agree
/// well. Where nothing beside them stands, three and more that agree hold each other.
/// @thread thread-bound: keeps its buffers; the letters are shared with copies
class SymbolMender {
 public:
  SymbolMender(const Pattern& pattern, const std::shared_ptr<const LetterFields>& letters, Rules rules = {});

  /// What is mended is decoded, with another place, frame, light and misfit, and what is damaged and hidden in its
  /// middle has a misfit without bounds.
  /// @return  the sightings that are mended, in their order; stands until the next call
  const std::vector<std::int32_t>& mend(const LetterScene& scene);

 private:
  enum class Held : std::uint8_t { kByOne, kByTwo, kAtCorner };
  [[nodiscard]] static DecodeRule rule_of(Held held);
  [[nodiscard]] bool is_asked(const LetterScene& scene, std::int32_t node);
  void ask_all(const LetterScene& scene);
  void ask_beside(const LetterScene& scene, std::size_t first, Held held);
  void sort_asked();
  void mend_asked(const LetterScene& scene, Held held);
  [[nodiscard]] bool may_be_held(Sightings& seen, const LetterPlace& place, Held held, std::int32_t node) const;
  [[nodiscard]] bool lies_there(Sightings& seen, const AskedLetter& asked) const;

  float pitch_px_;
  Rules rules_;
  LetterAligner aligner_;
  GroupMender groups_;
  Disputes disputes_;
  std::vector<std::int32_t> to_ask_, mended_;  // sightings
  std::vector<std::int32_t> turned_;           // sightings at corners, tilted more than others may be
  std::vector<std::size_t> agreeing_;          // of those asked, that show their letters where they should be
  std::vector<std::int32_t> lone_;             // sightings of these that one alone holds
};

}  // namespace slsd
