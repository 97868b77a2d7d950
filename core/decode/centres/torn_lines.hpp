// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/code/pattern.hpp"
#include "core/decode/centres/align_letters.hpp"

namespace slsd {

/// Refuses what an edge along its row or column leaves whole. Such an edge puts half of one surface's symbol beside
/// half of another's; those whose halves are of one letter look whole, and tell nothing of whose they are. The others
/// show it: there is light where their letters have none, which print does not give.
/// @thread thread-bound: keeps its buffers; the letters are shared with copies
class TornLines {
 public:
  TornLines(const Pattern& pattern, std::shared_ptr<const LetterFields> letters, Rules rules = {});

  /// Refuses what is decoded on a line where as many show other light as are decoded, until nothing more goes, and what
  /// that leaves alone.
  void refuse(const LetterScene& scene);

 private:
  struct Suspect {
    std::int32_t node;
    Direction forth;
  };
  void find_suspects(const Sightings& seen);
  void ask(const LetterScene& scene, std::int32_t node);
  bool refuse_outvoted(const LetterScene& scene);
  void refuse_left_alone(Sightings& seen) const;
  template <class Votes>
  [[nodiscard]] static bool is_outvoted(const Sightings& seen, const Suspect& suspect, const Votes& votes);

  float pitch_px_;
  Rules rules_;
  LetterAligner aligner_;
  std::vector<std::uint8_t> is_suspect_;  // of each sighting, a bit to each of its two lines
  std::vector<Suspect> suspects_;
  std::vector<std::int32_t> refused_;
  std::vector<std::uint8_t> is_asked_, shows_other_light_;  // of each sighting
};

}  // namespace slsd
